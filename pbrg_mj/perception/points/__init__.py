"""Scans to half-spaces without asking for lines: whatever echoes is kept off, whatever its shape.

parameters      of the sensor, the robot and the estimator
detect          one scan to points in the world; a lone echo waits until a second confirms it
memory          points over time: seen again, hidden, passed by beams, forgotten
separate        half-spaces between the robot's way to its target and the points
estimator       one tick of all that for all robots
"""
