"""Tick records in, an MCAP file out.

messages (record -> messages of a tick) -> provenance (what it takes to rerun) -> writer (chunks by simulated time)
-> mcap_writer (the file format) -> log_file (temporary name, lock, the log's own name)
"""
