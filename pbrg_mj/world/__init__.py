"""The world room: the MuJoCo plant and the ideal integrator behind one interface."""
