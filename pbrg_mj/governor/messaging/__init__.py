"""Distributed governors written for ONE robot, and what carries their messages.

- `program`: what a robot's program is given, sends, receives and answers
- `networked`: runs a program on every robot and carries the bytes: delays, reorders, loses, silences and counts them
"""
