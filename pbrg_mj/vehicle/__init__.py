"""The vehicle: velocities of hand points to commands of wheels.

- `hand_point`: the point ahead of the axle, driven like an integrator
- `drive`: wheel voltages or speeds, as the scenario's drive wants them
"""
