"""What stands in the world, and where."""
