"""Raw samples of the sensors to what robots see: seeded noise, held frames.

noise           parameters of the noise, from a scenario
noise_model     noise of another package in their place
beam_model      what a range sensor makes of true ranges, one effect after the other
readings        `Readings`, the result
sense           one tick: all of that for all robots
"""
