"""What a viewer draws, in Foxglove's schemas.

primitives -> static (once: floor, walls, robots), team (what moves), messages (poses, points, scans, events)
"""
