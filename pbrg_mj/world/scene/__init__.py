"""What stands in the world, as MuJoCo geoms and as plain geometry.

- `robot`: the robot's MJCF and its numbers
- `variation`: robots that differ from it
- `obstacles`: walls, boxes and moving boxes as geoms
- `footprints`: their rectangles on the floor, and distances from them
- `floor`: friction and rolling resistance by working area
- `terrain`: thresholds and ramps as geoms
- `contact_counters`: what counts each robot's contacts, by kind
- `model_index`: where each robot's numbers stand in the arrays of the composed model
"""
