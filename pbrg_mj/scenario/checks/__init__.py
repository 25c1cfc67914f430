"""What must hold between the keys of a scenario that are right one by one; each check yields diagnostics.

check             all checks in order, and those of small sections
robot_numbers     robots that are named exist, once
network           graph, links, delays, losses
world             walls, boxes, patches; what stands where at the start
work              rounds and beams in a tick
robots            keys that the chosen robot has no use for
physics           keys of the physics plant alone; its longest step
sampling          eq. 2, sampled once a tick, is stable on the graph
separation        formations keep the distance that robots are to keep
certificate       which governors and certificates go together
plug_ins          parts of other packages: installed, with options that fit
presets           a name of earlier versions
distances         of points from what stands on the floor
"""
