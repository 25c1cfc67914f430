"""Scans to half-spaces without asking for lines: whatever echoes is kept off, whatever its shape.

parameters      of the sensor, the robot and the estimator
beams           the beams of a scan, and which of them looks in a direction
deskew          a scan that takes time, as if taken at once
memory          points over time: seen again, hidden, passed by beams, forgotten
corner_bound    how far a corner between two beams may stick out
detect          one scan to points in the world; a lone echo waits until a second confirms it
known_free      the edge of what a scan shows to be free
obstacle_points both: where hand points must keep away, and the path to the target as far as it is free
hull            the distance of the hull of points from a segment (GJK)
face            the places of one face, its normal and its half-space
separate        half-spaces between the path and all places
range_flow      what a scan, compared with an older one, tells of velocities
motion          how fast each half-space's face comes nearer
estimator       one tick of all that for all robots
"""
