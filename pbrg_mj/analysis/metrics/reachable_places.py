"""Where robots that go beside obstacles can bring their formation, by the obstacles that stand still.

A place counts as reachable for a robot if a way leads there on which its hand point keeps the clearance and is never
farther from its place around the reference than at the start. So a box on the way is gone round, a door gone through,
and a long wall or a closed room parts a robot from what is behind it: who goes round its end goes back first. Other
robots are not in the way, nor need the formation be kept. Looked at on a grid: openings that are wider than two
clearances by less than `CELL` may count as closed, and no grid reaches farther than `FARTHEST`.
"""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.analysis.metrics.nearest_point import nearest
from pbrg_mj.analysis.metrics.obstacles import faces, footprints
from pbrg_mj.scenario.robots import robot_size
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.scene.footprints import Footprints, signed_distance, wall_margin

CELL = 0.03  # [m] of the grid
FARTHEST = 15.0  # [m] from a robot's start to its place around the reference: a million cells
NEAR = 4 * CELL  # [m] beyond the clearance: obstacles whose faces may carry the best place
TOUCHING = 1e-9  # [m] rounding of a margin


def too_far(scenario: Scenario, r: np.ndarray) -> bool:
    """Return whether some robot's place around `r` (2,) [m] is farther from its start than a grid reaches."""
    return _farthest(scenario, r) > FARTHEST


def is_cut_off(scenario: Scenario, r: np.ndarray) -> bool:
    """Return whether obstacles part a robot from its place around `r` (2,) [m], that place itself being free."""
    place, start = r + np.array(scenario.team.formation), np.array(scenario.team.start)
    free = np.flatnonzero(_free(scenario, place))
    blocked = [j for j in free.tolist() if not _free(scenario, _between(start[j], place[j])).all()]
    if not blocked:
        return False
    middle = _offsets(scenario, r)[1]
    return not all(_reached(scenario, r, j)[middle, middle] for j in blocked)


def nearest_reachable(scenario: Scenario, r: np.ndarray, rows: tuple[np.ndarray, np.ndarray]) -> np.ndarray | None:
    """Return the place m (2,) [m] nearest to `r` such that every robot reaches m + b_j; None if there is none.

    m also keeps C m <= d of `rows`, C (H, 2) and d (H,) [m]. It is exact where faces and these rows carry it, and
    within a cell where round things or corners do.
    """
    offsets, _ = _offsets(scenario, r)
    C, d = rows
    common = np.all((r + offsets) @ C.T <= d + TOUCHING, axis=-1)
    for j in range(scenario.robots):
        common &= _reached(scenario, r, j)
    if not common.any():
        return None
    far = np.where(common, np.linalg.norm(offsets, axis=-1), np.inf)
    m = r + offsets.reshape(-1, 2)[np.argmin(far)]
    return _on_the_faces(scenario, r, m, rows)


def _offsets(scenario: Scenario, r: np.ndarray) -> tuple[np.ndarray, int]:
    """Return m - r (k, k, 2) [m] of all cells that some robot may be asked about, and the row and column of r."""
    count = math.ceil(_farthest(scenario, r) / CELL) + 2
    axis = CELL * np.arange(-count, count + 1)
    return np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1), count


def _farthest(scenario: Scenario, r: np.ndarray) -> float:
    return float(np.linalg.norm(np.array(scenario.team.start) - scenario.team.formation - r, axis=1).max())


def _reached(scenario: Scenario, r: np.ndarray, robot: int) -> np.ndarray:
    """Return at which cells (k, k) of `_offsets` a robot can be; all that are free if it does not start free."""
    from scipy.ndimage import label  # takes a while to import

    offsets, count = _offsets(scenario, r)
    place = r + np.array(scenario.team.formation[robot])
    start = np.array(scenario.team.start[robot]) - place
    nearer = np.linalg.norm(offsets, axis=-1) <= np.linalg.norm(start) + CELL
    free = nearer & _free(scenario, (place + offsets).reshape(-1, 2)).reshape(nearer.shape)
    x, y = (np.floor(start / CELL).astype(int) + count).tolist()
    joined = np.empty(free.shape, dtype=np.int32)
    label(free, output=joined)  # cells that share a side
    own = joined[x : x + 2, y : y + 2]
    return np.isin(joined, own[own > 0]) if own.any() else free


def _on_the_faces(scenario: Scenario, r: np.ndarray, m: np.ndarray, rows: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return the point nearest to `r` before the faces that the formation at the cell `m` is beside; else m."""
    around, clearance = footprints(scenario), robot_size(scenario.robot).clearance
    C, d = [rows[0]], [rows[1]]
    for b in np.array(scenario.team.formation):
        gaps = signed_distance((m + b)[None], around)[0]
        for index in np.flatnonzero(gaps <= clearance + NEAR).tolist():
            G, h = _tangents(around, index, m + b)
            face = int(np.argmax(h - G @ (m + b)))
            C.append(G[face : face + 1])
            d.append(h[face : face + 1] - clearance - G[face : face + 1] @ b)
    exact = nearest(r, np.concatenate(C), np.concatenate(d))
    if exact is None or np.linalg.norm(exact - m) > 2 * CELL:
        return m
    return exact if _free(scenario, exact + np.array(scenario.team.formation)).all() else m


def _tangents(around: Footprints, index: int, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the faces of a footprint as G (f, 2), h (f,) [m]; of a column the tangent before the point q."""
    G, h = faces(around, index)
    if len(G):
        return G, h
    way = around.centre[index] - q
    G = (way / np.linalg.norm(way))[None]
    return G, G @ around.centre[index] - around.radius[index]


def _between(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return points (k, 2) on the straight way, both ends and every `CELL` or less."""
    steps = 2 + int(np.linalg.norm(end - start) / CELL)
    return start + np.linspace(0.0, 1.0, steps)[:, None] * (end - start)


def _free(scenario: Scenario, points: np.ndarray) -> np.ndarray:
    """Return which of the points (k, 2) [m] are the clearance or more off every obstacle."""
    return wall_margin(points, footprints(scenario), robot_size(scenario.robot).clearance) >= -TOUCHING
