"""The analysis room: metrics, comparison, export; reads logs, never live objects."""
