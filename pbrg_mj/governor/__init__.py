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
"""
