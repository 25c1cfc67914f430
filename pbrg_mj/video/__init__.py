"""Logs as pictures: drawn offscreen by MuJoCo in a process of its own, encoded by PyAV. Only the log is read."""
