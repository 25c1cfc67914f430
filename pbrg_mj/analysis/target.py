"""The best admissible formation: where the team should come to rest if it knew the true walls."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from pbrg_mj.scenario.placement import BODY_RADIUS, HAND_OFFSET
from pbrg_mj.scenario.schema import GivenHalfSpace, Scenario
from pbrg_mj.scenario.surroundings import Wall

CLEARANCE = BODY_RADIUS + HAND_OFFSET
PARALLEL = 1e-12  # rows whose determinant is smaller have no corner
FEASIBLE = 1e-9  # [m] rounding allowed when a candidate is tested against the other rows


def target(scenario: Scenario, reference: np.ndarray) -> np.ndarray | None:
    """Return the point (2,) nearest to `reference` r (2,) [m] whose formation lies behind every true half-space.

    All robots are bound: G.(m + b_j) <= h for all j (eq. 3). None when no formation fits.
    """
    G, h = true_half_spaces(scenario)
    formation = np.array(scenario.team.formation)
    return nearest(np.asarray(reference, dtype=float), G, h - (G @ formation.T).max(axis=1))


def true_half_spaces(scenario: Scenario, clearance: float = CLEARANCE) -> tuple[np.ndarray, np.ndarray]:
    """Return G (H, 2) and h (H,) [m] of all true walls, then of the given half-spaces, for hand points.

    Walls are moved inward by `clearance` [m]; given half-spaces are for hand points already.
    """
    viewpoint = np.mean(scenario.team.start, axis=0)
    rows = [_wall_row(wall, viewpoint, clearance) for wall in scenario.world.walls]
    rows += [_given_row(given) for given in given_half_spaces(scenario)]
    return np.array([row[0] for row in rows]).reshape(-1, 2), np.array([row[1] for row in rows])


def given_half_spaces(scenario: Scenario) -> tuple[GivenHalfSpace, ...]:
    """Return the half-spaces the scenario hands to its robots; none when they fit lines to beams."""
    return scenario.estimator.given if scenario.estimator.source == "given" else ()


def nearest(r: np.ndarray, C: np.ndarray, d: np.ndarray) -> np.ndarray | None:
    """Return the minimiser (2,) of ||m - r|| subject to C m <= d, unit rows C (H, 2); None when infeasible.

    Exact: in the plane at most two rows carry the optimum, so all sets of 0, 1 and 2 active rows are tried.
    """
    candidates = np.array([r, *_projections(r, C, d), *_corners(C, d)])
    slack = FEASIBLE * (1.0 + np.abs(d))
    feasible = candidates[np.all(candidates @ C.T <= d + slack, axis=1)]
    if not len(feasible):
        return None
    return feasible[np.argmin(np.linalg.norm(feasible - r, axis=1))]


def _projections(r: np.ndarray, C: np.ndarray, d: np.ndarray) -> np.ndarray:
    return r - (C @ r - d)[:, None] * C


def _corners(C: np.ndarray, d: np.ndarray) -> list[np.ndarray]:
    pairs = (list(pair) for pair in combinations(range(len(d)), 2))
    return [np.linalg.solve(C[pair], d[pair]) for pair in pairs if abs(np.linalg.det(C[pair])) > PARALLEL]


def _wall_row(wall: Wall, viewpoint: np.ndarray, clearance: float) -> tuple[np.ndarray, float]:
    """Return the row of the wall's face that looks at `viewpoint`: of its four faces the one farthest in front."""
    start, end = np.array(wall.start), np.array(wall.end)
    along = (end - start) / np.linalg.norm(end - start)
    across = np.array([-along[1], along[0]])
    middle = (start + end) / 2
    half_length = np.linalg.norm(end - start) / 2
    faces = [(s * along, half_length) for s in (1, -1)] + [(s * across, wall.thickness / 2) for s in (1, -1)]
    # A face's outward normal points at the team, so the half-space's own normal is its opposite.
    outward, depth = max(faces, key=lambda face: face[0] @ (viewpoint - middle) - face[1])
    return -outward, float(-outward @ middle - depth - clearance)


def _given_row(given: GivenHalfSpace) -> tuple[np.ndarray, float]:
    length = float(np.hypot(*given.normal))
    return np.array(given.normal) / length, given.offset / length
