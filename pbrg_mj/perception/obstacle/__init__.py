"""Confirmed tracks to one half-space per convex obstacle, in fixed slots.

In: the tracks of a robot, where the robots are that a half-space binds. Out: rows G q <= h.

    outline         tracks that are faces of one convex obstacle, and the corners of its outline
    polygons        convex hulls, and the widest gap between two of them
    half_space      the half-space with the widest gap between the robots bound and the obstacle
    slots           all of that: one half-space per obstacle, each in the slot it had before

Kernels name their arrays alike, of one robot:

    tracks (M,)                 of TRACK, in the world about its anchor
    links (before, after)       the faces before (M,) and after (M,) each, counter-clockwise round the robot, -1: none
    root (M,), distance (M,)    bool: the first face of an obstacle; how far that is from the robots bound [m]
    corners                     of an outline: points (N, 2) [m], s or along (N,) [m], sides (N, 3)
    robots, params              `BoundRobots`, `TrackParameters`
"""
