"""What is evaluated of every tick and never fed back."""
