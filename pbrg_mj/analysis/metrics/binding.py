"""What binds at the end of a run: why the governed reference is not elsewhere, and why the robots are not there.

docs/outcomes.md states every rule. All is read from what was recorded at the last tick, or in the last second.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from pbrg_mj.analysis.metrics.contacts import FIELDS, contact_flags
from pbrg_mj.analysis.metrics.margins import ball_radius
from pbrg_mj.analysis.metrics.multiplier_rows import NEGLIGIBLE, by_half_space, has_rows_of_robots
from pbrg_mj.analysis.metrics.obstacles import footprints, names
from pbrg_mj.governor.distributed.from_scenario import multiplier_cap
from pbrg_mj.log.read.run import Run
from pbrg_mj.scenario.robots import robot_size
from pbrg_mj.scenario.schema import WITHOUT_GOVERNOR, Scenario
from pbrg_mj.text import format_significant
from pbrg_mj.world.scene.footprints import least_along, signed_distance

Kind = Literal[
    "status", "cap", "half-space", "ball", "input", "network", "contact", "dead motor", "friction", "voltage"
]
CONTACTS = {"walls": "walls", "moving": "moving boxes", "robots": "each other"}
SHARE = 0.05  # of the largest weight: constraints with less are left out
MOST = 3  # half-spaces named
AVERAGING_TIME = 1.0  # [s] over which voltages and wheel speeds are averaged
ON_FACE = 0.1  # [m] between a half-space's line and the obstacle it is said to come from, at most
SAME_NORMAL_COSINE = np.cos(np.deg2rad(10.0))  # of the angle between normals of one line, seen by several robots
AXIS_COSINE = np.cos(np.deg2rad(1.0))  # of a normal along an axis


@dataclass(frozen=True)
class Binding:
    """One thing that binds, in words."""

    kind: Kind
    text: str


def bindings(run: Run) -> tuple[Binding, ...]:
    """Return what binds at the end, the governor's side first; empty when the team is where r asks it to be."""
    return (*_status(run), *_constraints(run), *_lag(run), *_robots(run))


def ticks_needed(scenario: Scenario) -> int:
    """Return how many of a run's last ticks `bindings` looks at."""
    return 2 + int((scenario.outcome.rest_time + AVERAGING_TIME) / scenario.timing.tick)


def _status(run: Run) -> Iterator[Binding]:
    status = str(run.ticks.status[-1])
    if status != "ok":
        yield Binding("status", f"governor {status}")


def _constraints(run: Run) -> Iterator[Binding]:
    """Yield caps, half-spaces with the ball, and input rows, by the multipliers in force."""
    multipliers = _multipliers(run)
    if multipliers is None:
        return
    cap, largest = multiplier_cap(run.scenario), multipliers.max(initial=0.0)
    if largest >= cap * (1 - 1e-9):
        robots = np.flatnonzero(multipliers.max(axis=1) >= cap * (1 - 1e-9)) + 1
        yield Binding("cap", f"multipliers of {_listed(robots)} at their cap {format_significant(cap, 3)}")
    rows, inputs = by_half_space(run.scenario, run.ticks.half_space_h.shape[2], multipliers)
    weights, ball = rows.sum(axis=2), run.scenario.governor.certificate == "ball"
    by_robot = has_rows_of_robots(run.scenario)
    least = max(NEGLIGIBLE, SHARE * max(weights.max(initial=0.0), inputs.max(initial=0.0)))
    for line in _lines(run, weights, least)[:MOST]:
        whom = int(np.sum([rows[one] for one in line], axis=0).argmax()) if by_robot else None
        yield Binding("half-space", _half_space(run, line, whom, float(sum(weights[one] for one in line))))
    if ball and weights.max(initial=0.0) >= least:
        yield from _ball(run)
    for robot in np.flatnonzero(inputs >= least)[:MOST].tolist():
        limit = f"{run.scenario.control.speed_limit:g} m/s"
        multiplier = format_significant(float(inputs[robot]), 2)
        yield Binding("input", f"robot {robot + 1}'s input rows, {limit}, lambda {multiplier}")


def _multipliers(run: Run) -> np.ndarray | None:
    """Return lambda (n, R) at the last tick: the governor's, else those of the optimum if m is there."""
    if run.scenario.governor.kind in WITHOUT_GOVERNOR:
        return None
    own = run.ticks.multipliers[-1]
    if np.isfinite(own).all() and own.any():
        return np.maximum(own, 0.0)
    gap = _gap_to_optimum(run)
    if gap is not None and gap <= run.scenario.outcome.tolerance:
        return np.maximum(run.optima.multipliers[-1], 0.0)
    return None


def _lines(run: Run, weights: np.ndarray, least: float) -> list[list[tuple[int, int]]]:
    """Return the half-spaces, owner and slot, of `least` weight or more, heaviest first; by lines they share."""
    G, h, lines = run.ticks.half_space_G[-1], run.ticks.half_space_h[-1], []
    order = np.argsort(-weights, axis=None, kind="stable")
    for owner, slot in np.transpose(np.unravel_index(order, weights.shape)).tolist():
        if weights[owner, slot] < least:
            break
        for line in lines:
            same = G[line[0]] @ G[owner, slot] > SAME_NORMAL_COSINE and abs(h[line[0]] - h[owner, slot]) < ON_FACE
            if same and owner not in [one for one, _ in line]:
                line.append((owner, slot))
                break
        else:
            lines.append([(owner, slot)])
    return lines


def _half_space(run: Run, line: list[tuple[int, int]], held: int | None, multiplier: float) -> str:
    first, owners = line[0], [owner for owner, _ in line]
    G, h = run.ticks.half_space_G[-1][first], float(run.ticks.half_space_h[-1][first])
    source = _source(run, owners[0], G, h)
    whose = (
        f"robot {owners[0] + 1}'s half-space" if len(owners) == 1 else f"half-space of {_listed(np.array(owners) + 1)}:"
    )
    origin = f" ({source})" if source else ""
    held_back = "" if held is None or owners == [held] else f", holding robot {held + 1}"
    return f"{whose} {half_space_text(G, h)}{origin}{held_back}, lambda {format_significant(multiplier, 2)}"


def half_space_text(G: np.ndarray, h: float) -> str:
    """Return G q <= h as one writes it: x <= 1.8, y >= -0.2, 0.71 x + 0.71 y <= 2.1."""
    x, y = map(float, G)
    for name, value in (("x", x), ("y", y)):
        if abs(value) > AXIS_COSINE:
            return f"{name} {'<=' if value > 0 else '>='} {format_significant(h / value, 3)}"
    return f"{x:.2g} x {'-' if y < 0 else '+'} {abs(y):.2g} y <= {format_significant(h, 3)}"  # x and y are up to 1


def _source(run: Run, owner: int, G: np.ndarray, h: float) -> str | None:
    """Return the obstacle whose face is the half-space's line, the nearest of several to the robot that sees it."""
    if run.scenario.estimator.source == "given":
        return "given"
    around = footprints(run.scenario)
    face = least_along(G, around)
    if not len(face):
        return None
    on_face = np.abs(face - h - robot_size(run.scenario.robot).clearance) <= ON_FACE
    distance = signed_distance(run.ticks.hand_true[-1, owner][None], around)[0]
    nearest = int(np.where(on_face, distance, np.inf).argmin())
    return names(run.scenario)[nearest] if on_face.any() else None


def _ball(run: Run) -> Iterator[Binding]:
    m, p, xi = _leaders_m(run)[None], run.ticks.p[-1:], run.ticks.xi[-1:]
    rho = float(ball_radius(m, p, xi)[0])
    if rho > run.scenario.outcome.tolerance:
        spread, states = float(np.linalg.norm(p[0] - m[0])), float(np.linalg.norm(xi))
        spread_text, states_text = format_significant(spread, 2), format_significant(states, 2)
        parts = f"robots' distances from m {spread_text}, integral states {states_text}"
        yield Binding("ball", f"the ball holds m {format_significant(rho, 2)} m off it ({parts})")


def _lag(run: Run) -> Iterator[Binding]:
    gap = _gap_to_optimum(run)
    if run.scenario.governor.kind not in WITHOUT_GOVERNOR and gap is not None and gap > run.scenario.outcome.tolerance:
        yield Binding("network", f"the leaders' m is {format_significant(gap, 2)} m from the optimum m*")


def _gap_to_optimum(run: Run) -> float | None:
    """Return the distance of the leaders' m from m* at the last reference tick, if that is recent and solved."""
    optima = run.optima
    if not len(optima.index) or optima.status[-1] != "solved":
        return None
    row = np.flatnonzero(run.ticks.index == optima.index[-1])
    if not len(row) or run.ticks.time[-1] - optima.time[-1] > run.scenario.outcome.rest_time:
        return None
    leaders = np.array(run.scenario.team.leaders) - 1
    return float(np.linalg.norm(run.ticks.m[row[0], leaders].mean(axis=0) - optima.m[-1]))


def _leaders_m(run: Run) -> np.ndarray:
    return run.ticks.m[-1, np.array(run.scenario.team.leaders) - 1].mean(axis=0)


def _robots(run: Run) -> Iterator[Binding]:
    """Yield what keeps robots from where m asks them to be: contacts, and in physics their motors."""
    scenario, time = run.scenario, run.ticks.time
    late = time >= time[-1] - AVERAGING_TIME
    shifted = run.ticks.hand_true[-1] - np.array(scenario.team.formation)
    short = np.linalg.norm(shifted - _leaders_m(run), axis=1) > scenario.outcome.tolerance / 2
    for kind in FIELDS:
        touching = np.flatnonzero(contact_flags(run, kind)[late].any(axis=0)) + 1
        if len(touching):
            yield Binding("contact", f"{_listed(touching)} in contact with {CONTACTS[kind]}")
    if scenario.plant != "physics":
        return
    for dead in scenario.disturbances.dead_motors:
        if dead.time <= time[-1] < (np.inf if dead.duration is None else dead.time + dead.duration):
            yield Binding("dead motor", f"robot {dead.robot}'s {dead.side} motor is dead")
            short[dead.robot - 1] = False
    if scenario.drive.kind == "voltage" and short.any():
        yield from _motors(run, late, short)


def _motors(run: Run, late: np.ndarray, short: np.ndarray) -> Iterator[Binding]:
    # The models need MuJoCo, which takes a while to load.
    from pbrg_mj.world.actuation.friction import friction_torques
    from pbrg_mj.world.scene.floor import floor_of
    from pbrg_mj.world.scene.robot import load_robot_model

    robot, floor, scenario = load_robot_model(run.scenario.robot), floor_of(run.scenario.world), run.scenario
    voltage = np.abs(run.ticks.command[late]).mean(axis=0)  # (n, 2)
    turning = np.abs(run.ticks.wheel_speed[late].mean(axis=0)) * robot.wheel_radius
    area = floor.area(run.ticks.body_pose_true[-1, :, :2])
    static = friction_torques(robot, scenario.drive.friction, floor.rolling_resistance[area])[:, 1]
    breakaway = static / robot.stall_torque * robot.voltage  # (n,)
    stuck = short & (turning < scenario.outcome.rest_speed).all(axis=1) & (voltage < breakaway[:, None]).all(axis=1)
    if stuck.any():
        share = (voltage / breakaway[:, None])[stuck].max(axis=1)
        nearest = np.flatnonzero(stuck)[share.argmax()]  # to breaking away
        most, needed = float(voltage[nearest].max()), float(breakaway[nearest])
        volts = f"{format_significant(most, 2)} of {format_significant(needed, 2)} V"
        text = f"wheels of {_listed(np.flatnonzero(stuck) + 1)} below breakaway, {volts}"
        yield Binding("friction", f"static friction: {text}")
    limited = short & (voltage >= robot.voltage).any(axis=1)
    if limited.any():
        yield Binding(
            "voltage", f"motors of {_listed(np.flatnonzero(limited) + 1)} at their limit of {robot.voltage:g} V"
        )


def _listed(robots: np.ndarray) -> str:
    numbers = robots.tolist()
    shown = ", ".join(map(str, numbers[:5])) + (f" and {len(numbers) - 5} more" if len(numbers) > 5 else "")
    return f"robot {shown}" if len(numbers) == 1 else f"robots {shown}"
