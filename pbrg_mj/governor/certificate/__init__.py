"""Certificates: which governed references keep every half-space for ever, from the states of the whole team.

With constant m the team follows a linear model, so a certificate is a statement about its future positions.

- `team_model`: the pre-stabilised team under constant m, sampled as it runs
- `motor_model`: the same behind the motors' lag and a delay
- `advances`: what a certificate says of one half-space: how far m may move along its normal
- `prediction_grid`: which predicted positions are looked at, and what may happen between them
- `directional_ball`: the ball of the motion across a half-space alone
- `ball`: the paper's ball, one row for each half-space
- `predictive`: all predicted positions, on a grid with a bound between its points
- `speed`: how large a step kappa of an advance the motors can follow
- `steering`: how fast robots can go and still steer by poses that are old
- `sight`: how large a step kappa keeps every robot's way within what it has seen
- `scalar_reference_governor`: how large a step kappa to a candidate all rows allow, by closed form
- `projection`: the nearest point to r that all half-spaces allow
- `nearest`: the same where rows are cones in m, by tangents
- `evaluate`: by how much an applied reference violates each certificate, tick by tick
- `by_name`: certificates by the names a scenario calls them
- `description`: a scenario's certificate in a few words for its log and its numbers
"""
