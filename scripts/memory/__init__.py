"""Runs in memory that is full of nonsense: what they read before it is written, or after it is freed, shows.

poison      fills NumPy's arrays
runs        runs that call every kernel, into a folder
"""
