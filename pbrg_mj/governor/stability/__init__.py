"""How long a round and how late a message may be, predicted from the scenario alone.

- `linear_step`: the longest explicit round at which the flow's linear modes decay
- `delay_margin`: the longest delay of the plain exchange at which they decay
- `proximal_step`: the bound below which proximal rounds converge
- `response`: how fast a team follows m, against how fast the flow finds it

What the curvature of rho adds is in neither of the first two, and known only in the run: no bounds, docs/theory.md says
how far off.
"""
