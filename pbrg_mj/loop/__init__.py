"""From a scenario to records: the closed loop, tick by tick.

simulation          one run: the closed loop put together, ticks in blocks, records
closed_loop         what it is made of
tick                one tick: sense, perceive, govern, control; the plant moves on between ticks
tick_data           what a tick sees, concludes and hands to the next
monitor             certificates, wind-up and the centralized optimum of ticks that have passed
record              everything one tick produced
batch               many seeds of one scenario at once
batch_group         those of them that one thread steps
batch_histories     what is kept of their runs
batch_team          the teams of a batch: what they have in common, their states, how they move, compiled
batch_control       their governors, compiled
sequential          worlds that cannot be stepped so, or differ: one after the other
resources           what a scenario asks of the machine, before it runs
network_warnings    what of the network its governor does not feel
response_warnings   whether the team follows references faster than the paper's flow finds them
stability_warnings  what makes a scenario likely to fail, before it runs
"""
