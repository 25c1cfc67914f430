"""Confirmed tracks to one half-space per convex obstacle, in fixed slots.

In: the tracks of a robot, where the robots are that a half-space binds. Out: rows G q <= h.

    outline         tracks that are faces of one convex obstacle, and the corners of its outline
    polygons        convex hulls, and the widest gap between two of them
    half_space      the half-space with the widest gap between the robots bound and the obstacle
    slots           all of that: one half-space per obstacle, each in the slot it had before
"""
