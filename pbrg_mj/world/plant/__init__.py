"""The plants: what a command does to the world within one tick.

- `interface`: what every plant offers: observe, truth, advance
- `build`: from a scenario to its plant
- `compose`: from a scenario to a MuJoCo model
- `physics`: that model, stepped
- `batch`: many copies of it, stepped in a batch
- `truth`: the true state, read from MuJoCo's arrays
- `contacts`: with what each robot was in contact
- `ideal`: the paper's integrators
- `mujoco_warnings`: MuJoCo's warnings as log messages
"""
