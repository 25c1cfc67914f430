"""The rollout governor: the network simulates its own future, and every robot checks its own part of it.

It holds the predictive certificate with messages that do not grow with the team: docs/rollout.md.

- `plan`: how long, in which steps and how exactly a team is rolled out: what all robots know beforehand
- `bounds`: how far a rolled-out position may be from the true one
- `prediction`: a step of the rollout and what it allows, compiled
- `verdicts`: from what robots have rolled out to what they allow, and what leaders do
- `messages`: what robots send, byte by byte
- `robot`: the program of one robot
- `team`: all robots at once, for messages that arrive within their round
- `governor`: the same as a governor
"""
