"""The governor that applies only what a certificate of the whole team has verified.

- `decide`: from what the half-spaces allow to the next reference
- `compiled`: the same from a certificate's advances, in one compiled call
- `flood`: one robot's data to all robots, hop by hop
- `robot`: the program of one robot whose leaders know every robot's rows
- `governor`: that exchange within a tick, computed at once
- `cycles`: the same where the exchange takes several ticks
- `consensus`: the smallest of the robots' steps kappa, and whether all are known
- `messages`: what robots of the layer send
- `layer`: the program of one robot behind any optimizer: of its candidate what all owners of half-spaces have verified
- `reference_update`: from the smallest of those steps to the next m, and its status
- `vectorized`: the layer within a tick, for all robots at once
- `advance_limits`: what stops advances in a scenario
- `from_scenario`: which of these a scenario asks for
"""
