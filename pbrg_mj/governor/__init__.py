"""The reference governor: from half-spaces and states to the reference that each robot may follow.

In: `HalfSpaces` of perception, the states p and xi, the operator's reference. Out: a `Solution` with every robot's
governed reference m_i, and beside it numbers that are never fed back.

- `problem`: what a governor is given and answers; how half-spaces become rows of constraints
- `centralized`: the optimum of the whole problem, by solvers that know everything
- `certificate`: which references keep every half-space for ever, from the predicted motion of the whole team
- `messaging`: distributed governors written for one robot, and what carries their messages
- `certified`: the recommended governor, which applies only what a certificate has verified
- `rollout`: the same with messages that do not grow with the team
- `distributed`: the paper's algorithm, rounds of messages between neighbours
- `optimizers`: how the robots agree on a candidate that the certified layer verifies
- `baselines`, `plug_in`: other governors, governors of other packages
- `velocity_filter`: what may change the velocities of eq. 2 before they are driven
- `paper_program`: the paper's algorithm as the program of one robot; `plug_in_program`: programs of other packages
- `monitor`: what is evaluated of every tick and never fed back
- `stability`: how long a round and how late a message may be, predicted from the scenario
- `registry`: all of them by the names a scenario calls them
- `check`: whether a governor of one's own keeps the protocol
- `check_messages`: whether robots know of each other by messages alone

Kernels name their arrays alike, with one more axis in front where ticks or worlds are stacked:

    q (n, 2), p (n, 2), xi (n, 2)   hand points, q - b and integral states of n robots [m]
    m (n, 2)                        governed references as the robots know them [m]
    G (n, K, 2), h (n, K)           half-spaces G . q <= h of each robot's K slots, unit normals, offsets [m]
    active (n, K), binds (n, K, n)  bool: whether there is one, and which robots it binds
    closing (n, K)                  how fast what is behind it comes nearer [m/s]
    spans (n, K, 2)                 from where to where along (-Gy, Gx) hand points are in the way of what comes [m]
    low (n, K), high (n, K)         how far the held m may advance along the normal [m]
    z (n, 4n + 2), zeta (n, 4n + 2) estimates of (m, p, xi) and their integral states
    lam (n, R), nu (n, 4)           multipliers of rows, and of the own p and xi
    error (2n, 2)                   (p - m, xi) at the held m [m]
    normals (R, 2), offsets (R,)    half-planes normals . x <= offsets, of places [m] or velocities [m/s]
"""
