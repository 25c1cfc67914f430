"""Which ticks of a run the page shows, and what it shows of the ticks between."""

from __future__ import annotations

import numpy as np

from pbrg_mj.analysis.metrics.margins import true_margin
from pbrg_mj.analysis.metrics.per_tick import largest, largest_multipliers, per_tick
from pbrg_mj.log.read.run import Run

MOST_FRAMES = 1500  # 25 a second for a run of 60 s
MOST_NUMBERS = 900_000  # of a whole page: 5 MB as base64 of 32-bit floats


def frame_ticks(run: Run, runs: int) -> np.ndarray:
    """Return the rows (F,) of the ticks to show on a page of `runs` runs: evenly spaced, and the last."""
    ticks, robots = run.ticks.hand_true.shape[:2]
    affordable = MOST_NUMBERS // (runs * (9 * robots + 12))
    stride = -(-ticks // max(2, min(MOST_FRAMES, affordable)))
    return np.unique(np.append(np.arange(0, ticks, stride), ticks - 1))


def states(run: Run, frames: np.ndarray) -> dict[str, np.ndarray]:
    """Return what the animation shows at each frame (F, ...): SI units, true poses, m* as last solved."""
    t = run.ticks
    return {
        "time": t.time[frames],
        "pose": t.body_pose_true[frames],
        "hand": t.hand_true[frames],
        "m": t.m[frames],
        "r": t.reference[frames],
        "mstar": _held(run, run.optima.m, frames),
    }


def indicators(run: Run, frames: np.ndarray) -> dict[str, np.ndarray]:
    """Return what the figures show besides (F, ...): of the ticks since the last frame, the worst one."""
    t = run.ticks
    starts = np.append(0, frames[:-1] + 1)
    gaps = np.linalg.norm(_at_reference(run) - run.optima.m[:, None, :], axis=-1)
    leaders = np.array(run.scenario.team.leaders) - 1
    return {
        "margin": np.fmin.reduceat(true_margin(t, run.scenario), starts),
        "gap": _held(run, gaps.max(axis=1), frames),
        "leader_gap": _held(run, gaps[:, leaders].max(axis=1), frames),
        "spread": np.fmax.reduceat(t.consensus_spread, starts),
        "certificate": np.fmax.reduceat(t.worst_row, starts),
        "storage": np.fmax.reduceat(t.storage, starts),
        "multiplier": np.fmax.reduceat(per_tick(run, largest_multipliers), starts),
        "multiplier_star": _held(run, largest(run.optima.multipliers).max(axis=1), frames),
    }


def _at_reference(run: Run) -> np.ndarray:
    """Return m (S, n, 2) at the ticks of the centralized solves; NaN for one whose tick is lost."""
    rows = np.minimum(np.searchsorted(run.ticks.index, run.optima.index), len(run.ticks.index) - 1)
    known = run.ticks.index[rows] == run.optima.index
    return np.where(known[:, None, None], run.ticks.m[rows], np.nan)


def _held(run: Run, values: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Return `values` (S, ...) of the last centralized solve at or before each frame; NaN before the first."""
    last = np.searchsorted(run.optima.index, run.ticks.index[frames], side="right") - 1
    if not len(values):
        return np.full((len(frames), *values.shape[1:]), np.nan)
    known = (last >= 0).reshape(-1, *(1,) * (values.ndim - 1))
    return np.where(known, values[np.maximum(last, 0)], np.nan)
