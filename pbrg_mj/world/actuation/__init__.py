"""What acts on the robots, in the order in which a command passes.

- `radio`: delay and jitter between the governor and the robots
- `speed_loop`: the wheel-speed controller on board
- `motor_driver`: saturation and duty cycles
- `friction`: gear friction and rolling resistance in the motors, by working area
- `disturbances`: pushes and dead motors
- `kidnapping`: robots lifted off the floor and put down elsewhere
"""
