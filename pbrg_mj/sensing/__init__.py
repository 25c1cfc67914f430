"""The sensing room: seeded noise between raw readings and what robots see."""
