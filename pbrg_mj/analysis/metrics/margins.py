"""Safety of the recorded states: margins, vectorised over time."""

from __future__ import annotations

import numpy as np

from pbrg_mj.analysis.metrics.best_formation import given_half_spaces, given_rows
from pbrg_mj.log.read.run import TickSeries
from pbrg_mj.scenario.schema import Scenario


def ball_radius(m: np.ndarray, p: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """Return rho (T,) [m] at references m (T, 2) and states p, xi (T, n, 2)."""
    return np.sqrt(np.sum((m[:, None, :] - p) ** 2, axis=(1, 2)) + np.sum(xi**2, axis=(1, 2)))


def sensed_margin(ticks: TickSeries) -> np.ndarray:
    """Return the least h - G.q (T,) [m] of ESTIMATED hand points and all half-spaces that bind them, else inf."""
    least = np.full(len(ticks.time), np.inf)
    for owner in range(ticks.hand.shape[1]):
        G, h = ticks.half_space_G[:, owner], ticks.half_space_h[:, owner]
        reach = _largest(G @ ticks.hand.transpose(0, 2, 1), ticks.half_space_binds[:, owner])
        least = np.minimum(least, (h - reach).min(axis=-1, initial=np.inf))
    return least


def true_margin(ticks: TickSeries, scenario: Scenario) -> np.ndarray:
    """Return how far each TRUE hand point stands behind the true line (T, n) [m]; inf where there is none.

    Against walls, boxes and moving boxes where they are at the time; in a run without any, against the half-spaces
    given to the robots. Logs too old to have margins to moving boxes leave those out.
    """
    return np.fmin(static_margin(ticks, scenario), ticks.moving_margin)


def static_margin(ticks: TickSeries, scenario: Scenario) -> np.ndarray:
    """Return the same (T, n) [m] without moving boxes."""
    if obstructed(scenario):
        return ticks.wall_margin
    if given_half_spaces(scenario):
        return given_margin(scenario, ticks.hand_true)
    return np.full(ticks.wall_margin.shape, np.inf)


def given_margin(scenario: Scenario, hand: np.ndarray) -> np.ndarray:
    """Return the least h - G.q (..., n) [m] of hand points (..., n, 2) over the given half-spaces that bind them."""
    rows = given_rows(scenario)
    return np.where(rows.binds.T, rows.h - hand @ rows.G.T, np.inf).min(axis=-1)


def obstructed(scenario: Scenario) -> bool:
    """Whether anything stands around the robots that the world measures margins from."""
    return bool(scenario.world.all_obstacles)


def _largest(values: np.ndarray, among: np.ndarray) -> np.ndarray:
    return np.where(among, values, -np.inf).max(axis=-1, initial=-np.inf)
