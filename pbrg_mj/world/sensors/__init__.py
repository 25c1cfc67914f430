"""What the robots' sensors read, and when."""
