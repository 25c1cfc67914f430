"""The best admissible formation: where the team should come to rest if it knew the true obstacles."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from math import prod

import numpy as np

from pbrg_mj.analysis.metrics.nearest_point import FEASIBLE, nearest
from pbrg_mj.analysis.metrics.obstacles import distance_to_obstacles, faces, footprints, names
from pbrg_mj.analysis.metrics.reachable_places import FARTHEST, is_cut_off, nearest_reachable, too_far
from pbrg_mj.scenario.robots import robot_size
from pbrg_mj.scenario.schema import GivenHalfSpace, Scenario

MOST_CHOICES = 4096  # ways to choose one face per obstacle; more of them are not tried


@dataclass(frozen=True)
class HalfSpaceRows:
    """Half-spaces G q <= h for hand points, and which robots each binds."""

    G: np.ndarray  # (H, 2) unit rows
    h: np.ndarray  # (H,) [m]
    binds: np.ndarray  # (H, n) bool


@dataclass(frozen=True)
class BestFormation:
    """The best admissible formation, or why none is known; the half-spaces that define it."""

    point: np.ndarray | None  # (2,) [m]
    reason: str | None
    rows: HalfSpaceRows


def best_formation(scenario: Scenario, reference: np.ndarray) -> BestFormation:
    """Return the point nearest to `reference` r (2,) [m] whose formation q_j = m + b_j the scenario admits.

    docs/metrics.md says what is admitted under each `estimator.scope`. The point is exact, or there is none.
    """
    r, given = np.asarray(reference, dtype=float), given_rows(scenario)
    if scenario.estimator.scope == "own":
        return _beside_obstacles(scenario, r, given)
    if scenario.world.columns:
        return BestFormation(None, "columns are round: which of their tangents is best is not sought", given)
    choices = [_separating(scenario, index) for index in range(len(names(scenario)))]
    for name, options in zip(names(scenario), choices, strict=True):
        if not options:
            return BestFormation(None, f"no face of {name} separates the team's start from it", given)
    if prod(map(len, choices)) > MOST_CHOICES:
        return BestFormation(None, f"more than {MOST_CHOICES} ways to pass the obstacles", given)
    tried = [_behind(scenario, r, rows) for rows in _all_rows(given, choices)]
    return min(tried, key=lambda best: np.inf if best.point is None else np.linalg.norm(best.point - r))


def given_half_spaces(scenario: Scenario) -> tuple[GivenHalfSpace, ...]:
    """Return the half-spaces the scenario hands to its robots; none when they fit lines to beams."""
    return scenario.estimator.given if scenario.estimator.source == "given" else ()


def given_rows(scenario: Scenario) -> HalfSpaceRows:
    """Return the given half-spaces: they bind every robot, or with `scope: own` the one that knows them."""
    given, n = given_half_spaces(scenario), scenario.robots
    normal = np.array([one.normal for one in given], dtype=float).reshape(-1, 2)
    length = np.linalg.norm(normal, axis=1)
    owner = np.array([one.robot for one in given], dtype=int) - 1
    binds = (owner[:, None] == np.arange(n)) | (scenario.estimator.scope == "team")
    return HalfSpaceRows(normal / length[:, None], np.array([one.offset for one in given]) / length, binds)


def _behind(scenario: Scenario, r: np.ndarray, rows: HalfSpaceRows) -> BestFormation:
    """Return the best formation behind all rows: G.(m + b_j) <= h for every j that a row binds (eq. 3)."""
    point = nearest(r, *_of_the_team(scenario, rows))
    return BestFormation(point, None if point is not None else "no admissible formation", rows)


def _of_the_team(scenario: Scenario, rows: HalfSpaceRows) -> tuple[np.ndarray, np.ndarray]:
    """Return C (H, 2), d (H,) [m] such that C m <= d is the formation at m behind all rows."""
    reach = np.where(rows.binds, rows.G @ np.array(scenario.team.formation).T, -np.inf).max(axis=1, initial=-np.inf)
    return rows.G, rows.h - reach


def _separating(scenario: Scenario, index: int) -> list[tuple[np.ndarray, float]]:
    """Return the rows of an obstacle's faces before which ALL robots start, moved out by the clearance."""
    G, h = faces(footprints(scenario), index)
    before = np.all(np.array(scenario.team.start) @ G.T <= h, axis=0)
    return [(G[face], float(h[face]) - robot_size(scenario.robot).clearance) for face in np.flatnonzero(before)]


def _all_rows(given: HalfSpaceRows, choices: list[list[tuple[np.ndarray, float]]]) -> Iterator[HalfSpaceRows]:
    for chosen in product(*choices):
        all_robots = np.ones((len(chosen), given.binds.shape[1]), dtype=bool)
        yield HalfSpaceRows(
            G=np.vstack([np.array([G for G, _ in chosen]).reshape(-1, 2), given.G]),
            h=np.append([h for _, h in chosen], given.h),
            binds=np.vstack([all_robots, given.binds]),
        )


def _beside_obstacles(scenario: Scenario, r: np.ndarray, given: HalfSpaceRows) -> BestFormation:
    """With `scope: own` robots may stand beside obstacles, and no farther than they get without going back."""
    best = _behind(scenario, r, given)
    if best.point is None:
        return best
    if names(scenario) and too_far(scenario, best.point):
        reason = f"the reference is more than {FARTHEST:g} m away: where robots get beside obstacles is not sought"
        return BestFormation(None, reason, given)
    if is_cut_off(scenario, best.point):
        point = nearest_reachable(scenario, r, _of_the_team(scenario, given))
        return BestFormation(point, None if point is not None else "no formation that every robot reaches", given)
    clear = distance_to_obstacles(scenario, best.point + np.array(scenario.team.formation))
    if clear >= robot_size(scenario.robot).clearance - FEASIBLE:
        return best
    return BestFormation(
        None, "the formation at r meets an obstacle, and what is free beside obstacles is not convex", given
    )
