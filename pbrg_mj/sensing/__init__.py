"""Raw samples of the sensors to what robots see: seeded noise, held frames.

noise           parameters of the noise, from a scenario
frame_buffer    random numbers of frames to come
noise_model     noise of another package in their place
beam_model      what a range sensor makes of true ranges, one effect after the other
cone            the nearest thing in a beam's view
signal_strength echoes lost for want of light
camera_faults   lost frames, robots not found or mixed up
ultra_wideband  places by radio ranges, in place of the camera's
pose_filter     poses from wheel encoders and the camera
readings        `Readings`, the result
sense           one tick: all of that for all robots
"""
