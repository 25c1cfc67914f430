"""The log room: MCAP out and in."""
