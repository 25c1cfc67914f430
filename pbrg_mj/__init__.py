"""A physics-based benchmark for distributed reference governors."""
