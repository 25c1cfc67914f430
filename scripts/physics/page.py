"""docs/physics.md, from what was measured."""

from __future__ import annotations

from bench import KINDS, ROBOT
from motor_page import motor_section
from numbers_table import numbers_table
from step_size_page import step_size_section
from table_rows import table_rows
from tracking_page import tracking_section

from pbrg_mj.world.actuation.friction import wheel_load


def page(found: dict) -> str:
    """Return the page's text."""
    parts = (
        *(_model(), motor_section(found), step_size_section(found), tracking_section(found)),
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
{table_rows(rows)}
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
{table_rows(errors)}
Patches do not set robots apart: they shift the whole team, here by {low:.0f} to {high:.0f} mm, whether a robot stands
on a patch or beside it: the integral states distribute the deficit of the robots that are stuck. The paper may mean
more than that, an error of each robot's own.

![Static errors of five robots on five floors, from below a millimetre without friction to ten
centimetres on a carpet](img/physics_floors.png)

A patch's sliding friction acts through the tyres' contacts, looked up below each wheel's centre once per tick. On a
slippery floor wheels at full voltage spin, and the robot gains over its first 0.5 s:

| sliding friction | mu x wheel load / mass [m/s^2] | measured [m/s^2] | rim after 0.5 s [m/s] | robot [m/s] |
|---|---|---|---|---|
{table_rows(slips)}"""


def _limits(found: dict) -> str:
    worst = max(abs(s["acceleration_m_s2"] / s["closed_form_m_s2"] - 1) for s in found["slip"])
    return f"""
## Limits

- A tyre that slips fast hops by some hundredths of a millimetre, as soft contacts do; its mean traction is off the
  closed form by up to {100 * worst:.0f} %.
- Rolling resistance counts with the static wheel load; a robot that is pushed or tilts keeps it.
- No winding inductance, heat or battery sag; no play in the gears; the wheels' encoders are exact."""
