"""A log in, whole or damaged; arrays out.

existing (is there a log) -> mcap_records (checked records)
-> header (what is embedded) -> run (all series), scans, ticks (message by message), digest (one number for all)
layout -> columns (messages to columns), column_store (where they lie), series (columns as attributes) -> run
"""
