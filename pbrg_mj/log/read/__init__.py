"""A log in, whole or damaged; arrays out.

mcap_records (checked records) -> header (what is embedded) -> run (all series), scans, ticks (message by message)
"""
