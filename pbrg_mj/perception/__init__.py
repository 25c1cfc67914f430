"""Scans to half-spaces: what each robot knows of the obstacles around it.

In: `Readings` (ranges and pose estimates with noise). Out: `HalfSpaces` G q <= h for hand points, unit rows.

    scan            one scan to line features in the body frame
    track           lines over time, in the world frame
    obstacle        confirmed tracks to one half-space per obstacle
    half_spaces     `HalfSpaces`, the result
    setup           parameters, from a scenario
    perceive        one tick: all of that for all robots
    points          beside these: points of any shape to half-spaces, `estimator.source: points`
    estimator       `perceive` with its setup, or a plug-in in its place
"""
