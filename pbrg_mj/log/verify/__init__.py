"""A log against a second run of its scenario.

replay (run again, tick by tick) -> difference (where two messages differ)
"""
