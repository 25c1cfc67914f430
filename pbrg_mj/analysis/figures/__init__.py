"""A run as one figure of chosen panels, in the style of a paper.

figure            panels put on one page, and the page into a file
panel             one panel in axes that the caller has
trajectories      the plan: trajectories, walls, formation
time_histories    panels over time: references, margins, gap, consensus, multipliers
style             colours, lines and markers of robots
"""
