"""The team: the communication graph, and how robots move together between the governor's answers.

- `network`: the communication graph and the leaders
- `graph`: the network of a scenario
- `channel`: delay, loss and silence of messages on its links
- `exchange`: what robots hear of their neighbours' p and xi where those messages are late or lost
- `pre_stabiliser`: PI consensus towards the governed reference, eq. 2
- `sampled`: the team under eq. 2 as it is driven, u held from tick to tick: stability and delay margin
- `wind_up`: which robot's integral state grows although it is stuck
"""
