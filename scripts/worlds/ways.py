"""Which ways of robots to their places meet something, how many robots got past it, and how many could by sliding."""

from __future__ import annotations

import numpy as np

from pbrg_mj.analysis.metrics.obstacles import footprints
from pbrg_mj.scenario.robots import robot_size
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.scene.footprints import Footprints, footprints_of, wall_margin

STEP = 0.01  # [m] between places of a way that are looked at, and of a formation that slides
KEPT = 0.03  # [m] beside the clearance: the governor's margin of 1 cm, and what poses and ranges may be wrong by
TURNS = np.radians([0, *(side * turn for turn in range(3, 88, 3) for side in (1, -1))])  # of a step, the least first


def ways(scenario: Scenario, around: Footprints, end: np.ndarray) -> tuple[int, int]:
    """Return of how many robots the straight way to their place meets `around`, and how many at `end` are beyond that.

    A way meets what stands within the clearance of it. A wall that the place itself is behind is never passed.
    """
    clearance = robot_size(scenario.robot).clearance
    start = np.array(scenario.team.start)
    place = np.array(scenario.operator.reference) + np.array(scenario.team.formation)
    met = past = 0
    for first, last, now in zip(start, place, end, strict=True):
        far = float(np.linalg.norm(last - first))
        direction, along = (last - first) / far, np.arange(0.0, far, STEP)
        blocked = along[wall_margin(first + along[:, None] * direction, around, clearance) < 0.0]
        if len(blocked):
            met += 1
            past += int((now - first) @ direction > blocked[-1])
    return met, past


def to_pass(name: str, scenario: Scenario) -> Footprints:
    """Return what stands still; of a doorway the wall without its opening, so that every way through it counts."""
    if name != "families/doorway":
        return footprints(scenario)
    walls = scenario.world.walls
    return footprints_of([walls[0].model_copy(update={"end": walls[1].end})])


def end_of_sliding(scenario: Scenario) -> np.ndarray:
    """Return where robots (n, 2) [m] end that are in formation and only ever come nearer to the reference.

    Nothing is unknown to them, and of all free steps of 1 cm they take the one nearest to the reference's direction.
    No step leads away, as none does of who takes the nearest point to r of a convex set in which m is.
    """
    solid, clearance = footprints(scenario), robot_size(scenario.robot).clearance + KEPT
    formation, reference = np.array(scenario.team.formation), np.array(scenario.operator.reference)
    leader = scenario.team.leaders[0] - 1
    m = np.array(scenario.team.start)[leader] - formation[leader]
    margin = float(wall_margin(m + formation, solid, clearance).min())
    while (far := float(np.linalg.norm(reference - m))) > STEP:
        x, y = reference - m
        for turn in np.arctan2(y, x) + TURNS:
            step = m + STEP * np.array([np.cos(turn), np.sin(turn)])
            then = float(wall_margin(step + formation, solid, clearance).min())
            if then >= min(margin, 0.0) and np.linalg.norm(reference - step) < far:
                break
        else:
            break
        m, margin = step, then
    return m + formation
