"""The world: everything between the wheel commands and the raw sensor readings.

A command (n, 2) goes in, an `Observation` (poses, ranges) and the `Truth` (for the record only) come out, tick by tick.

- `scene`: what stands in the world: robot, obstacles and their footprints, floor, and the model's index
- `actuation`: commands to wheel torques: radio, speed loop, motor driver, friction; disturbances; kidnapped robots
- `sensors`: camera and beams, and when each takes its samples
- `plant`: the model composed of all this and stepped in MuJoCo, alone or as a batch; the paper's ideal integrator
- `physics_steps`: seconds as whole physics steps
"""
