"""The page's section on the physics step."""

from __future__ import annotations

from bench import ROBOT
from step_cost import ROBOTS
from step_cost import STEPS as COST_STEPS
from step_size import CLOSED_LOOP, DURATION, FINEST, STEPS, TAU

from pbrg_mj.scenario.schema import LONGEST_PHYSICS_STEP


def step_size_section(found: dict) -> str:
    """Return it as Markdown, from what was measured."""
    limit = 1000 * ROBOT.wheel_inertia / ROBOT.bristle_damping
    finite = [step for step, finite in found["reversals_finite"].items() if finite]
    diverged = [step for step, finite in found["reversals_finite"].items() if not finite]
    apart = " and ".join(f"{1000 * found['seeds'][name]['largest_m']:.0f} mm" for name in CLOSED_LOOP)
    rows = "".join(f"| {' | '.join(row)} |\n" for row in _rows(found))
    return f"""
## The physics step

| | closed form, or {_ms(FINEST)} | {" | ".join(map(_ms, STEPS))} |
|---|---|{"---|" * len(STEPS)}
{rows}
Time constants are fitted to a start with 2 V; from 4 V on tyres slip. The angle is that of a wheel on the floor after
8 s of 1.65 V plus a sine of 1.5 V and 2.5 s. The last rows are distances of hand points in {DURATION:g} s of the closed
loop from where they are with {_ms(FINEST)}: the largest one, and after it the largest one at the end. Sensors are exact
there: noise decides when a wheel that sticks breaks away, and with it runs of seeds 1 and 2 come to be {apart} apart.
A part of the distance is the camera's: it takes a frame at the first step after it is due, another instant at another
step.

How it is integrated:

- Euler's rule, the motor a plain gain K/R, and friction a passive LuGre element of its own (`dcmotor` with
  `input="none"`). With `implicitfast` the derivative of a LuGre force is that of bristles that stick, which gives a
  sliding wheel an inertia of step times bristle damping: a whole `dcmotor` with bristles of 0.02 N m s/rad had a time
  constant of 144 ms instead of {1000 * TAU["floor"]:.0f} ms at 2 ms. In processor time a step of {ROBOTS} robots takes
  {found["step_cost"]["ratio"]:.2f} of what it takes with those, alternating every {COST_STEPS} steps (bound: 1.1).
- Half of the back-EMF is taken implicitly (the actuator's `damping`) and half explicitly (its `biasprm`): the
  trapezoidal rule, whose time constant is exact to second order. All implicit, a wheel in the air is 4 % too slow at
  2 ms.
- Euler's rule moves positions by the new velocity, half a step early. So a new voltage acts by half over its first step
  (`pbrg_mj/world/actuation/motor_driver.py`).

The step is at most {_ms(LONGEST_PHYSICS_STEP)}; a scenario with a longer one is refused. Bristles' damping acts
explicitly, so a wheel in the air diverges beyond its inertia over that damping, {limit:.2g} ms. Full voltages of either
sign, drawn anew every 10 ms or so for 30 s in the air and on the floor, stay finite at {", ".join(map(_ms, finite))}
and not at {", ".join(map(_ms, diverged))}."""


def _rows(found: dict) -> list[tuple[str, ...]]:
    taus, angles, loops = found["time_constants_s"], found["driven_angles_rad"], found["closed_loop"]
    rows = [
        (
            f"time constant, {'wheels in the air' if where == 'air' else 'on the floor'}",
            f"{1000 * tau:.0f} ms",
            *(_percent(taus[where, step] / tau - 1) for step in STEPS),
        )
        for where, tau in TAU.items()
    ]
    turned = (f"{1000 * (angles[step] - angles[FINEST]):+.0f} mrad" for step in STEPS)
    rows.append(("angle of a driven wheel", f"{angles[FINEST]:.3f} rad", *turned))
    for name in CLOSED_LOOP:
        far = [loops[name, step] for step in STEPS]
        cells = (f"{1000 * one['largest_m']:.1f} mm; {1000 * one['final_m']:.2f} mm" for one in far)
        rows.append((f"`{name}`", "0", *cells))
    return rows


def _percent(share: float) -> str:
    return f"{100 * share:+.2f} %"


def _ms(step: float) -> str:
    return f"{1000 * step:g} ms"
