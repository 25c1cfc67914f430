"""Which half-space each of the governor's multipliers belongs to, and where half-spaces held robots."""

from __future__ import annotations

import numpy as np

from pbrg_mj.log.read.run import TickSeries
from pbrg_mj.scenario.schema import Scenario

NEGLIGIBLE = 1e-3  # [m] so little a multiplier moves m by half as much


def by_half_space(scenario: Scenario, slots: int, multipliers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return multipliers (..., n, R) by owner, slot and row of that half-space, and those of input rows (..., n).

    A ball's row is one of the robots held back; intervals have two rows, one for each way along the normal. How
    other packages' certificates order theirs is not known: no rows.
    """
    n = multipliers.shape[-2]
    intervals = scenario.governor.certificate in ("directional_ball", "predictive")
    rows = n if has_rows_of_robots(scenario) else 2 * intervals
    half_spaces = multipliers[..., : slots * rows].reshape(*multipliers.shape[:-1], slots, rows)
    inputs = multipliers[..., slots * rows :].sum(axis=-1)
    return half_spaces, inputs if scenario.control.speed_limit is not None else np.zeros(inputs.shape)


def has_rows_of_robots(scenario: Scenario) -> bool:
    """Return whether a half-space has one row, and multiplier, for each robot."""
    governor = scenario.governor
    directional = governor.certificate == "directional_ball" and governor.kind == "distributed"
    return directional or governor.certificate == "ball"


def binding_area(ticks: TickSeries, scenario: Scenario) -> np.ndarray:
    """Return the corners (T, 2, 2) [m], lower and upper, around the points at which lines held robots at each tick.

    A line holds robots where its multipliers are more than negligible; its point is the one nearest to the foremost
    robot that it binds, or that robot itself beyond the line. Where nothing holds, the corners are inf and -inf.
    """
    G, h = ticks.half_space_G, ticks.half_space_h
    weights = by_half_space(scenario, h.shape[2], ticks.multipliers)[0].sum(axis=-1)
    tick, owner, slot = np.nonzero(ticks.half_space_active & (weights > NEGLIGIBLE))
    normal, q = G[tick, owner, slot], ticks.hand_true[tick]
    ahead = h[tick, owner, slot, None] - np.einsum("ki,kji->kj", normal, q)
    whom = np.where(ticks.half_space_binds[tick, owner, slot], ahead, np.inf).argmin(axis=1)
    each = np.arange(len(tick))
    points = q[each, whom] + np.maximum(ahead[each, whom, None], 0.0) * normal
    known = np.isfinite(points).all(axis=1)
    area = np.stack([np.full((len(h), 2), np.inf), np.full((len(h), 2), -np.inf)], axis=1)
    np.minimum.at(area[:, 0], tick[known], points[known])
    np.maximum.at(area[:, 1], tick[known], points[known])
    return area
