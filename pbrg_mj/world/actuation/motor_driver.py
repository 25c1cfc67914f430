"""What a motor driver makes of the voltages and speeds it is asked for. Pure."""

from __future__ import annotations

import numpy as np

from pbrg_mj.kernel import kernel


def saturate(wanted: np.ndarray, limit: float) -> np.ndarray:
    """Scale each robot's pair of wheel commands (n, 2) down to `limit`, so that a fast robot keeps its direction."""
    return saturated(wanted, limit)


def quantise(voltage: np.ndarray, supply: float, levels: int) -> np.ndarray:
    """Round voltages to the nearest of the duty cycles 0, 1/levels, ..., 1 each way of `supply` [V]; 0: leave them."""
    return quantised(voltage, supply, levels) if levels else voltage


def over_first_step(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return the voltages over the first physics step of new ones: the mean of both.

    Euler's rule moves positions by the new velocity, so that what changes acts half a step early; the mean over the
    first step makes up for that (docs/physics.md).
    """
    return (before + after) / 2


@kernel
def saturated(wanted, limit):
    """Compute what `saturate` returns, of `wanted` (n, 2)."""
    kept = np.empty((len(wanted), 2))
    for j in range(len(wanted)):
        scale = limit / max(abs(wanted[j, 0]), abs(wanted[j, 1]), limit)
        kept[j, 0], kept[j, 1] = wanted[j, 0] * scale, wanted[j, 1] * scale
    return kept


@kernel
def quantised(voltage, supply, levels):
    """Compute what `quantise` returns for one level or more, of `voltage` (n, 2)."""
    return np.rint(voltage / supply * levels) * (supply / levels)
