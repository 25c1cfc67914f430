"""The vehicle: velocities of hand points to commands of wheels.

- `hand_point`: the point ahead of the axle, driven like an integrator
- `drive`: wheel voltages or speeds, as the scenario's drive wants them
- `motor_lag`: what a robot computes of its own motion behind motors and delays
"""
