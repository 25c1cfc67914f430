"""What acts on the robots."""
