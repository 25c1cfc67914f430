"""The loop room: the tick, the run, the record."""
