"""Raw, noise-free sensors of the composed model. Noise is added in `pbrg_mj.sensing`.

- `sampling`: when a sensor with its own rate and delay takes a sample, in physics steps
- `camera`: the overhead camera's poses
- `beams`: range beams around each robot
- `surfaces`: how obliquely rays meet surfaces, and how much light these send back
"""
