"""Tick records in, an MCAP file out."""
