"""The paper's algorithm: rounds of messages between neighbours (eqs. 16-30).

- `rounds`: the flow, its estimates, and rounds in which every message arrives
- `channel`: delay, loss and silence of messages, and what the links hold between rounds
- `network_rounds`: rounds over such a channel, of estimates or of wave variables
- `governor`: a tick's rounds, and what each robot takes from them
"""
