"""The page's section on motors and friction."""

from __future__ import annotations

from table_rows import table_rows

from pbrg_mj.world.actuation.friction import wheel_load


def motor_section(found: dict) -> str:
    """Return it as Markdown, from what was measured."""
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
{table_rows(rows)}
The closed form of the speed is the balance stall torque (V / Vn - w / w0) = Coulomb torque. Creep is the mean over 2 s,
beginning 1 s (wheel) or 2 s (robot) after the voltage. Breakaway is where a ramp of 20 s turns the wheels. A step of
voltage makes the bristles overshoot where they come to rest. On the floor it turns the wheels from \
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


def _off(share: float) -> str:
    return f"{100 * share:.1g} %" if share > 1e-6 else "less than 1e-4 %"
