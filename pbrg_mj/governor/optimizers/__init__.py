"""Distributed optimizers: how the robots agree on the best m in R^2 that the rows of all of them allow.

    minimize sum_i delta_i ||r_i - m||^2    subject to    m in X_i for every robot i,

X_i being what the rows of robot i's own half-spaces allow in the team's present state. Each is one robot's step from
its own data and one message of every neighbour; what an optimizer says is a candidate, which the certified layer
verifies.

- `interface`: what a robot gives its optimizer, and what the optimizer offers
- `synchronizer`: the same iteration everywhere though messages are late or lost
- `nids`: the network-independent step size algorithm (Li, Shi and Yan 2019)
- `admm`: consensus by alternating directions (Boyd et al. 2011; Shi et al. 2014)
- `flow_in_m`: primal-dual flow with PI consensus and augmented multipliers
- `paper_flow`: the paper's flow in R^(4n + 2), by itself
- `scalar`: no messages: straight to r
- `team`: an optimizer on all robots at once
- `by_name`: all of them by the names a scenario calls them
"""
