"""What a viewer draws, in Foxglove's schemas: static scene, team, poses and scans."""
