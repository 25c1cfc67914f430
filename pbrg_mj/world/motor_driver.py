"""What a motor driver makes of the voltages and speeds it is asked for. Pure."""

from __future__ import annotations

import numpy as np


def saturate(wanted: np.ndarray, limit: float) -> np.ndarray:
    """Scale each robot's pair of wheel commands (n, 2) down to `limit`, so that a fast robot keeps its direction."""
    largest = np.abs(wanted).max(axis=1, keepdims=True)
    return wanted * (limit / np.maximum(largest, limit))


def quantise(voltage: np.ndarray, supply: float, levels: int) -> np.ndarray:
    """Round voltages to the nearest of the duty cycles 0, 1/levels, ..., 1 each way of `supply` [V]; 0: leave them."""
    return np.rint(voltage / supply * levels) * (supply / levels) if levels else voltage
