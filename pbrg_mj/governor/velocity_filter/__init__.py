"""Velocity filters: what may change the velocities of eq. 2 before they are driven, whatever the governor.

- `interface`: the protocol `VelocityFilter`
- `barrier`: every robot's control barrier function: nearest velocity that approaches half-spaces no faster than allowed
- `potential_field`: every robot is repelled from the half-spaces that it sees
- `separation`: robots keep their distance from each other
- `separation_rows`: the rows of velocities that it keeps
- `evasion`: where they go before what comes presses them against something
- `nearest_velocity`: what meets them, the wheels' limits and the turn of a robot that is pushed back
- `turning`: how much slower they go past each other because they turn
"""
