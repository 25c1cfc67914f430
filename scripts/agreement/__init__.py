"""How many rounds, bytes and millimetres each optimizer needs: a sweep of its own parameters, for docs/optimizers.md.

- `static`: rounds until all robots agree on the optimum of a problem that stands still
- `moving`: how far the reference is from the optimum of the moment while the team drives
"""
