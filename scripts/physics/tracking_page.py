"""The page's section on tracking."""

from __future__ import annotations

from bench import KINDS, ROBOT
from driving import RADIUS, SPEED, START_LOSS, TAU
from table_rows import table_rows


def tracking_section(found: dict) -> str:
    """Return it as Markdown, from what was measured."""
    runs = found["tracking"]

    def cells(shape: str, friction: float) -> list[str]:
        return [_error(runs[shape, kind, friction], name) for kind in KINDS for name in ("worst", "across")]

    rows = (
        (shape, f"{'with' if friction else 'no'} friction", *cells(shape, friction))
        for shape in ("line", "circle")
        for friction in (0.0, 1.0)
    )
    line, circle = (runs[shape, "voltage", 0.0] for shape in ("line", "circle"))
    lost = ROBOT.no_load_speed * ROBOT.coulomb_torque / ROBOT.stall_torque / (SPEED / ROBOT.wheel_radius)
    return f"""
## Tracking

The hand point is driven at {SPEED:g} m/s from rest along a line of 1 m and round a circle of radius {RADIUS:g} m
(1.9 m), by velocity alone, without position feedback. The pre-stabiliser assumes an integrator, and the table shows how
close to one the robot is. *At that time* is the largest distance from where an integrator would be, *from the path* the
largest distance from the line y = 0 or from the circle, each with its share of the path's length:

| path | motors | `voltage`, at that time | from the path | `speed_loop`, at that time | from the path |
|---|---|---|---|---|---|
{table_rows(rows)}
With the speed loop the bound of 1 % of the path holds in both senses, with friction and without. What remains are the
loop's own time constant of 10 ms and the wheels' rolling radius: they sink 0.1 mm into the floor, a quarter of a
percent of speed.

Open loop without friction holds the bound on the line if only the path counts. At that time, and on the circle in both
senses, it misses the bound. All of the loss arises at the start: a motor that drives has a time constant of
tau = {TAU:.3f} s, so a hand point that is commanded to v from rest lags by tau v in its first direction, for good. In a
steady turn the wheels' speeds are steady as well, and no more is lost: the circle keeps its radius and is shifted
against the start's direction. It does not shrink to R / sqrt(1 + (v tau / R)^2), as with a lag of the velocity in the
world frame.

| open loop, no friction | closed form | line | circle |
|---|---|---|---|
| behind along the start's direction after 5 tau | tau v = {1000 * START_LOSS[0]:.1f} mm | {_mm(line["behind_m"][0])} \
| {_mm(circle["behind_m"][0])} |
| radius drawn | {1000 * RADIUS:g} mm less a quarter of a percent = {997.5 * RADIUS:.1f} mm | - | \
{_mm(found["drawn_radius_m"])} |
| largest distance from where it should be less tau v, after 5 tau | 0 | {_error(line, "beyond_start")} \
| {_error(circle, "beyond_start")} |
| distance at rest from the path's end, where it was commanded to stop | 0 | \
{_error(line, "rest")} | {_error(circle, "rest")} |

Without the loss at the start, the error is a quarter of a percent of the path. The stop gives that loss back, because
the motors run on for as long: over a path from rest to rest, as dead reckoning is evaluated, the open loop misses the
end by that quarter of a percent of the path's length. With friction the open loop keeps only a straight path:
friction takes {100 * lost:.0f} % of a speed of {SPEED:g} m/s.

![A hand point driven round a circle: with the speed loop on the wanted circle, open loop without friction 2 cm behind,
open loop with friction on a smaller circle](img/physics_tracking.png)"""


def _share(share: float) -> str:
    return f"{100 * share:.2g} %" if share > 1e-6 else "0 %"


def _mm(length: float) -> str:
    return f"{1000 * length:.1f} mm"


def _error(run: dict, name: str) -> str:
    return f"{_mm(run[f'{name}_m'])}, {_share(run[f'{name}_share'])}"
