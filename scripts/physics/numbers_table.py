"""The table of the model's numbers."""

from __future__ import annotations

from bench import ROBOT

from pbrg_mj.world.actuation.friction import wheel_load


def numbers_table() -> str:
    """Return a Markdown table of what models/robot.xml says."""
    R = ROBOT
    share = 2 * wheel_load() / (R.mass * 9.81)
    friction = f"{R.coulomb_torque:g}, {R.static_torque:g} N m"
    rows = (
        ("body", f"disc of radius {R.body_radius:g} m; mass {R.mass:g} kg; centre of mass 4.5 mm above the axle"),
        ("wheels", f"radius {R.wheel_radius:g} m, {R.track:g} m apart; {100 * share:.0f} % of the weight"),
        ("hand point", f"{R.hand_offset:g} m ahead of the axle; clearance {R.clearance:g} m"),
        ("nominal voltage", f"{R.voltage:g} V, the largest"),
        ("stall torque, no-load speed, after a gear of 30:1", f"{R.stall_torque:g} N m, {R.no_load_speed:g} rad/s"),
        ("back-EMF at the wheel K", f"{R.motor_constant:g} V s/rad"),
        ("winding", f"{R.motor_constant * R.voltage / R.stall_torque:.3g} Ohm"),
        ("current at stall", f"{R.stall_torque / R.motor_constant:.2g} A"),
        ("inertia at the wheel: wheel, gear, rotor", f"{R.wheel_inertia:.2g} kg m^2"),
        ("the same with half of the robot's mass", f"{R.driven_inertia:.3g} kg m^2"),
        ("top speed without friction", f"{R.top_speed:g} m/s"),
        ("Coulomb, static torque", f"{friction}: {_of_stall(R.coulomb_torque)}, {_of_stall(R.static_torque)} of stall"),
        ("Stribeck speed", f"{R.stribeck_speed:g} rad/s"),
        ("bristles", f"{R.bristle_stiffness:g} N m/rad, {R.bristle_damping:g} N m s/rad"),
    )
    return "| what | number |\n|---|---|\n" + "\n".join(f"| {what} | {number} |" for what, number in rows)


def _of_stall(torque: float) -> str:
    return f"{100 * torque / ROBOT.stall_torque:g} %"
