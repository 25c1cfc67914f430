"""An MCAP file in, whole or damaged; a run as arrays out."""
