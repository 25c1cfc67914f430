"""How long a round and how late a message may be, predicted from the scenario alone.

- `step_bound`: the longest stable round
- `delay_margin`: the longest stable delay of the plain exchange
"""
