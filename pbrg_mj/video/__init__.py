"""Logs as videos and stills: drawn offscreen by MuJoCo in a process of its own, encoded by PyAV. Only the log is read.

A run goes in, a `.mp4`, `.webm`, `.gif`, `.webp` or `.png` comes out.

- `settings`: what to draw: camera, size, layers, the frames' times
- `playback`: where robots, wheels and boxes were at any time; the model in that pose
- `framing`: the area that cameras frame, and the part of the picture they have for it
- `camera`: cameras with a known projection, and their paths
- `overlay`, `markers`, `caption`, `glyphs`, `legend`: what is drawn beyond the model: beams, references, trails, text
- `gl`, `offscreen`, `worker`: a software GL that works here, the renderer, and the process it runs in
- `encode`: pictures to a file
- `render`: all of it in order; `viewer`: the same scene in MuJoCo's own window
"""
