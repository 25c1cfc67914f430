"""From a scenario to records: the closed loop, tick by tick.

simulation          one run: the closed loop put together, ticks in blocks, records
closed_loop         what it is made of
tick                one tick: sense, perceive, govern, control; the plant moves on between ticks
compiled_control    the control of a tick, from governed references to voltages, in one compiled call
tick_data           what a tick sees, concludes and hands to the next
monitor             certificates, wind-up and the centralized optimum of ticks that have passed
record              everything one tick produced
batch               many seeds of one scenario at once
batch_group         those of them that one thread steps
batch_histories     what is kept of their runs
batch_team          the teams of a batch: their states, how they move, compiled
batch_control       their governors, compiled
sequential          worlds that cannot be stepped so, or differ: one after the other
resources           what a scenario asks of the machine, before it runs
certificate_warnings  a certificate that its governor does not apply
governor_warnings   keys of other governors than its own
network_warnings    what of the network its governor does not feel
response_warnings   whether the team follows references faster than the paper's flow finds them
stability_warnings  what makes a scenario likely to fail, before it runs

Kernels of a batch step W worlds. Their `states` are the members of `TeamStates`, `team` is `CompiledControl.packed`:

    pose (W, n, 3)                       x, y, heading as the robots know them [m], [rad]
    xi, displacement, m (W, n, 2)        integral states, q from p + b, governed references [m]
    diverged (W,), command (W, n, 2)     bool; voltages [V]
    G (W, n, K, 2), h (W, n, K), active (W, n, K), binds (W, n, K, n)   of HalfSpaces
    closing (W, n, K), spans (W, n, K, 2)   of HalfSpaces where something comes nearer
    graph, formation (n, 2) [m]          first, neighbours, leader of `GraphArrays`; b
    alpha_r, leak, tick                  gains of eq. 2 and the tick [s]
    sizes, motor                         as for `motor_voltages` and `wheel_speeds_of`
    facets, numbers, apart               as for `write_driven`; whether robots keep distances at all
    q, p (n, 2)                          of one world [m]
"""
