"""docs/physics.md, from what was measured."""

from __future__ import annotations

from collections.abc import Iterable

from bench import ROBOT
from driving import RADIUS, SPEED, START_LOSS, TAU
from numbers_table import numbers_table
from step_size_page import step_size_section

from pbrg_mj.world.actuation.friction import wheel_load

KINDS = ("voltage", "speed_loop")


def page(found: dict) -> str:
    """Return the page's text."""
    parts = (
        *(_model(), _motor(found), step_size_section(found), _tracking(found)),
        *(_drives(found), _floor(found), _limits(found)),
    )
    head = "# The robot's physics, and the evidence\n\n<!-- Written by `python scripts/physics`; change it there. -->\n"
    return head + "".join(f"\n{part.strip()}\n" for part in parts)


def _model() -> str:
    casters = ROBOT.mass * 9.81 - 2 * wheel_load()
    return f"""
Every number and figure here comes from `python scripts/physics` (needs the `plot` extra). The tests
(`tests/test_world_motor.py`, `test_world_step_size.py`, `test_world_floor.py`, `test_world_working_areas.py`,
`test_world_speed_loop.py`, `test_vehicle_tracking.py`) assert the same bounds.

## The model

`models/robot.xml`: a differential-drive robot of the size of the paper's TDO-48, modelled after data sheets of its
class, not identified from one machine. It opens in MuJoCo's viewer as it is; `models/scene.xml` stands it on the floor,
with a keyframe `home`.

{numbers_table()}

Motor and LuGre friction are actuators of MuJoCo: `J dw/dt = k (V - K w) - friction`,
`k = stall torque / nominal voltage`, `K = nominal voltage / no-load speed`.
Casters have no friction: a soft contact that slides presses harder the faster it slides, and casters of friction 0.01
took 40 % of the weight off the wheels at 0.3 m/s. The drag of a ball caster, about 1 % of the {casters:.2f} N that both
carry, is 2 % of the gears' Coulomb friction."""


def _motor(found: dict) -> str:
    speed, creep, coasting = found["speed_against_voltage"]["worst"], found["robot_creep"], found["coasting"]
    stored, rise = f"{coasting['bristles_can_store_J']:.1e} J", f"{coasting['largest_rise_J']:.1e} J"
    resisted = f"{creep['bristles_0.03']:.1g} and {creep['bristles_0.1']:.1g} m/s"
    rows = (
        (
            "steady wheel speed at 0.5 V to 6 V, wheels in the air",
            "closed form",
            f"off by {_off(speed['stands'])}",
            "2 %",
        ),
        ("the same on the floor", "closed form", f"off by {_off(speed['floor'])}", "2 %"),
        *map(_broken_away, found["breakaway"]),
        (
            "creep of a wheel in the air, at 30, 50, 70 and 90 % of breakaway",
            "0",
            f"{found['wheel_creep']:.1g} rad/s",
            "1e-6 rad/s",
        ),
        ("creep of the robot, at 30, 50, 70 and 90 % of breakaway", "0", f"{creep['even_floor']:.1g} m/s", "1e-5 m/s"),
        ("the same at 90 %, rolling resistance 0.03 and 0.1", "0", resisted, "1e-5 m/s"),
        ("coasting from 3 V: largest rise of kinetic energy", "what bristles give back", rise, stored),
    )
    return f"""
## Motors and friction

| what | expected | measured | bound |
|---|---|---|---|
{_table(rows)}
The closed form of the speed is the balance stall torque (V / Vn - w / w0) = Coulomb torque. Creep is the mean over 2 s,
beginning 1 s (wheel) or 2 s (robot) after the voltage. Breakaway is where a ramp of 20 s turns the wheels. A step of
voltage swings the bristles beyond where they come to rest. On the floor it turns the wheels from \
{_percent(found, "floor, friction 1")} of breakaway on, in the air from {_percent(found, "air")}; on the floor from \
{_percent(found, "floor, friction 0.5")} with `drive.friction` 0.5 and {_percent(found, "floor, friction 2")} with 2.

![Wheel speed against voltage on the closed form; the voltage drive moves nothing below 0.06 m/s, the speed loop follows
at any speed; kinetic energy falls to nothing within half a second](img/physics_motor.png)

Rolling resistance c of a floor is the torque c N r per wheel, N = {wheel_load():.3f} N its static load, added to the
LuGre Coulomb and static torques: bristles hold it without creep. MuJoCo's rolling friction of contacts (`condim="6"`)
with the same torque is a soft constraint: at 90 % of breakaway the robot creeps at {creep["contacts_0.03"]:.1g} m/s
(c = 0.03) and {creep["contacts_0.1"]:.1g} m/s (c = 0.1), which would let every static error decay."""


def _percent(found: dict, name: str) -> str:
    return f"{100 * found['breakaway_of_steps'][name]:.0f} %"


def _broken_away(found: dict) -> tuple[str, ...]:
    limit, measured = found["limit_N_m"], found["measured_N_m"]
    what = f"breakaway torque, rolling resistance {found['rolling_resistance']:g}"
    return what, f"{limit:.3g} N m", f"{measured:.3g} N m, {100 * (measured / limit - 1):+.1f} %", "2 %"


def _tracking(found: dict) -> str:
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
{_table(rows)}
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


def _drives(found: dict) -> str:
    voltage, loop = (found["deadband"][kind] for kind in KINDS)
    limit = ROBOT.static_torque / ROBOT.stall_torque * ROBOT.top_speed
    coulomb = ROBOT.coulomb_torque / ROBOT.stall_torque * ROBOT.voltage
    beyond = limit - ROBOT.coulomb_torque / ROBOT.stall_torque * ROBOT.top_speed
    stribeck = 1000 * ROBOT.stribeck_speed * ROBOT.wheel_radius
    stuck = f"{voltage['deadband_m_s']:g} m/s; by the closed form any below {limit:.2g} m/s"
    follows = f"none: {1000 * loop['wanted_m_s'][0]:g} mm/s moves at {1000 * loop['moved_m_s'][0]:.3g} mm/s"
    rows = (
        ("a command is", "a wheel voltage [V]", "a wheel speed [rad/s]"),
        ("fastest command", f"{ROBOT.voltage:g} V", f"{ROBOT.loaded_speed:g} rad/s, reached against Coulomb friction"),
        ("fastest commanded speed tried that moves nothing", stuck, follows),
    )
    return f"""
## Drives

| | `voltage` | `speed_loop` |
|---|---|---|
{_table(rows)}
Both scale a robot's two commands together, so that it keeps its direction when it cannot keep its speed. The loop is
proportional-integral with feed-forward at the physics rate; its gains follow from the model and one time constant of
10 ms (`pbrg_mj/world/actuation/speed_loop.py`). It is not MuJoCo's own velocity input, whose integral needs a position
set-point, and to which no duty cycles can be applied. `drive.pwm_levels` rounds voltages of either drive to the duty
cycles of a motor driver. The loop measures wheel speeds exactly; an encoder's steps are not modelled.

`drive.friction_compensation` adds to `voltage` that of the motors' Coulomb friction in the direction of the wanted
speed, {coulomb:.2g} V, as their data sheet has it: nothing is measured, and a floor's resistance is not known.
The steady speed is the one wanted then; from rest wheels break away where the closed form has the rest of the
static torque, {beyond:.2g} m/s. To compensate all of the static torque would turn wheels that much faster than
wanted. The voltage grows linearly up to the Stribeck speed, {stribeck:.2g} mm/s of the rim, so that noise about rest
turns nothing."""


def _floor(found: dict) -> str:
    shifted = 1000 * found["floors"]["patches of 0.1 and 0.05, else 0"]
    low, high = shifted.min(), shifted.max()
    errors = ((name, " ".join(f"{1000 * e:.1f}" for e in error)) for name, error in found["floors"].items())
    slips = (
        (
            f"{s['friction']:g}",
            f"{s['closed_form_m_s2']:.3g}",
            f"{s['acceleration_m_s2']:.3g}",
            f"{s['rim_m_s']:.2g}",
            f"{s['over_ground_m_s']:.2g}",
        )
        for s in found["slip"]
    )
    return f"""
## Floors

The paper observes "a small static error due to the difference of static friction that depends on the working area".
The governed team of `floor/friction_patches` after 60 s, distance of each robot from its place in the formation:

| floor | robots 1 to 5 [mm] |
|---|---|
{_table(errors)}
Patches do not set robots apart: they shift the whole team, here by {low:.0f} to {high:.0f} mm, whether a robot stands
on a patch or beside it: the integral states distribute the deficit of the robots that are stuck. The paper may mean
more than that, an error of each robot's own.

![Static errors of five robots on five floors, from below a millimetre without friction to ten
centimetres on a carpet](img/physics_floors.png)

A patch's sliding friction acts through the tyres' contacts, looked up below each wheel's centre once per tick. On a
slippery floor wheels at full voltage spin, and the robot gains over its first 0.5 s:

| sliding friction | mu x wheel load / mass [m/s^2] | measured [m/s^2] | rim after 0.5 s [m/s] | robot [m/s] |
|---|---|---|---|---|
{_table(slips)}"""


def _limits(found: dict) -> str:
    worst = max(abs(s["acceleration_m_s2"] / s["closed_form_m_s2"] - 1) for s in found["slip"])
    return f"""
## Limits

- A tyre that slips fast hops by some hundredths of a millimetre, as soft contacts do; its mean traction is off the
  closed form by up to {100 * worst:.0f} %.
- Rolling resistance counts with the static wheel load; a robot that is pushed or tilts keeps it.
- No winding inductance, heat or battery sag; no play in the gears; the wheels' encoders are exact."""


def _table(rows: Iterable[tuple[str, ...]]) -> str:
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def _off(share: float) -> str:
    return f"{100 * share:.1g} %" if share > 1e-6 else "less than 1e-4 %"
