"""A run as one figure of chosen panels, in the style of a paper; `figure.plot` makes it."""
