"""A few numbers per tick that metrics, events and pictures take from a run's large columns."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pbrg_mj.analysis.metrics.logged_motion import LoggedMotion
from pbrg_mj.analysis.metrics.margins import sensed_margin
from pbrg_mj.governor.certificate.evaluate import predicted_rows, worst_rows
from pbrg_mj.log.read.run import Run, TickSeries
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Scenario

BLOCK_TICKS = 2**12  # of a run looked at at a time, at most
BLOCK_BYTES = 2**24  # of their columns, at most: a tick of a hundred robots has 0.7 MB

PerTick = Callable[[TickSeries, Scenario], np.ndarray]


class CertificateRows:
    """`certificate_rows` of the blocks of a run, which come in their order."""

    def __init__(self, scenario: Scenario):
        self._motion = LoggedMotion(scenario)

    def __call__(self, ticks: TickSeries, scenario: Scenario) -> np.ndarray:
        """Return them of the next ticks."""
        motion = self._motion.of(ticks)
        return _certificate_rows(ticks, scenario, motion)


def certificate_rows(ticks: TickSeries, scenario: Scenario) -> np.ndarray:
    """Return the worst value (T, 3) [m] of each certificate in `evaluate.NAMES`, over the leaders' m.

    The ticks are a run's first ones; of a block at a time: `CertificateRows`.
    """
    return CertificateRows(scenario)(ticks, scenario)


def in_order(quantity: PerTick, scenario: Scenario) -> PerTick:
    """Return a quantity that may be taken of the blocks of a run one after the other."""
    return CertificateRows(scenario) if quantity is certificate_rows else quantity


def _certificate_rows(ticks: TickSeries, scenario: Scenario, motion: np.ndarray | None) -> np.ndarray:
    spaces = HalfSpaces(ticks.half_space_G, ticks.half_space_h, ticks.half_space_active, ticks.half_space_binds)
    states = ticks.p, ticks.xi, ticks.m[:, np.array(scenario.team.leaders) - 1]
    formation = np.array(scenario.team.formation, dtype=float)
    return worst_rows(spaces, states, formation, predicted_rows(scenario), motion)


def least_sensed_margin(ticks: TickSeries, scenario: Scenario) -> np.ndarray:
    """Return the least margin (T,) [m] to a sensed half-space."""
    return sensed_margin(ticks)


def sensing(ticks: TickSeries, scenario: Scenario) -> np.ndarray:
    """Return whether some robot knows a half-space (T,)."""
    return np.asarray(ticks.half_space_active.any(axis=(1, 2)))


def robot_distance(ticks: TickSeries, scenario: Scenario) -> np.ndarray:
    """Return the least distance (T,) [m] between two bodies' centres; inf for one robot."""
    place, least = ticks.body_pose_true[..., :2], np.full(len(ticks.time), np.inf)
    for i in range(place.shape[1] - 1):
        least = np.minimum(least, np.linalg.norm(place[:, i + 1 :] - place[:, i : i + 1], axis=-1).min(axis=1))
    return least


def integral_state(ticks: TickSeries, scenario: Scenario) -> np.ndarray:
    """Return the largest ||xi_j|| (T,) [m]."""
    return np.linalg.norm(ticks.xi, axis=-1).max(axis=1)


def state_size(ticks: TickSeries, scenario: Scenario) -> np.ndarray:
    """Return the largest size (T,) [m] of a component of p, xi and m; NaN if one is."""
    return np.max([np.abs(values).max(axis=(1, 2)) for values in (ticks.p, ticks.xi, ticks.m)], axis=0)


def sent_per_robot(ticks: TickSeries, scenario: Scenario) -> np.ndarray:
    """Return what a robot sends on the average (T,) [bytes]."""
    return ticks.bytes_sent.mean(axis=1)


def multiplier_sums(ticks: TickSeries, scenario: Scenario) -> np.ndarray:
    """Return the sum of each robot's multipliers (T, n)."""
    return ticks.multipliers.sum(axis=-1)


def largest_multipliers(ticks: TickSeries, scenario: Scenario) -> np.ndarray:
    """Return each robot's largest multiplier (T, n); 0 for one that has no rows."""
    return largest(ticks.multipliers)


def largest(multipliers: np.ndarray) -> np.ndarray:
    """Return the largest along the last axis, of multipliers (..., R); 0 where there are none."""
    return multipliers.max(axis=-1, initial=0.0) if multipliers.shape[-1] else np.zeros(multipliers.shape[:-1])


def ticks_of_a_block(run: Run) -> int:
    """Return how many ticks of a run may be looked at at a time; the larger the team, the fewer."""
    a_tick = sum(values.nbytes for values in vars(run.ticks.rows(0, 1)).values())
    return min(max(BLOCK_BYTES // max(a_tick, 1), 1), BLOCK_TICKS)


def per_tick(run: Run, quantity: PerTick) -> np.ndarray:
    """Return a quantity at all ticks of a run, whose columns are read a block at a time."""
    known = run.reduced.get(quantity.__name__)
    if known is not None:
        return known
    many, taken = ticks_of_a_block(run), in_order(quantity, run.scenario)
    rows = range(0, max(len(run.ticks.index), 1), many)
    return np.concatenate([taken(run.ticks.rows(first, first + many), run.scenario) for first in rows])
