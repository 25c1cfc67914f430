"""How long a round and how late a message may be for the flow's linear modes, predicted from the scenario alone.

What the curvature of rho adds is in neither, and known only in the run: no bounds, docs/theory.md says how far off.

- `linear_step`: the longest round at which they decay
- `delay_margin`: the longest delay of the plain exchange at which they decay
"""
