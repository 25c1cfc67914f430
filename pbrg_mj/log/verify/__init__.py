"""A log against a second run of its scenario, bit for bit."""
