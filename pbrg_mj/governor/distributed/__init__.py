"""The paper's algorithm: rounds of messages between neighbours (eqs. 16-30).

- `estimates`: what the robots remember between rounds, and the flow's parameters
- `infeasibility`: when a robot suspects that no reference is admissible
- `penalty`: how large a cap of the multipliers keeps the penalty exact
- `equations`: one round in plain NumPy, as the paper writes it; `rounds`: the same compiled, `descent` and `proximal`
  parts of it
- `link_states`: what robots keep of the messages that come
- `network_equations`: rounds over a channel in plain NumPy; `network_rounds`, `waves`: the same compiled
- `compiled_tick`: a tick in which every message arrives, in one compiled call
- `governor`: a tick's rounds, and what each robot takes from them
- `from_scenario`: the governor with a scenario's gains
"""
