"""The governor that applies only what a certificate of the whole team has verified.

- `decide`: from what the half-spaces allow to the next reference
- `governor`: the robots' exchange within a tick, computed at once
"""
