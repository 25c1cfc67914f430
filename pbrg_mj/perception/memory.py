"""What robots keep of their scans from tick to tick."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.perception.half_spaces import HalfSpaces


@dataclass(frozen=True)
class PerceptionMemory:
    """Every robot's tracks, where it stood at its last scan, and the half-spaces made of them. Never written to."""

    tracks: np.ndarray  # (n, M) of TRACK
    stands: np.ndarray  # (n,) of STAND
    half_spaces: HalfSpaces
