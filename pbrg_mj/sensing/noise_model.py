"""Noise of another package in place of ours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pbrg_mj.plugins import blaming, copied


class NoiseModel(Protocol):
    """What sensors add to the truth; `random` is the only source of chance, so that a seed means the same run."""

    def scan(self, ranges: np.ndarray, random: np.random.Generator) -> np.ndarray:
        """Return one robot's scan (beams,) [m] of true ranges (beams,), -1: no hit; NaN where nothing comes back."""
        ...

    def pose(self, pose: np.ndarray, random: np.random.Generator) -> np.ndarray:
        """Return one robot's pose (3,) as the camera has it, of the true x, y [m] and heading [rad]."""
        ...


@dataclass(frozen=True)
class PlugInNoise:
    """A noise model whose answers are checked; what lies beyond the sensor's range limits comes back as nothing."""

    inner: NoiseModel
    name: str

    def scan(self, ranges: np.ndarray, random: np.random.Generator, low: float, high: float) -> np.ndarray:
        """Return a scan (beams,) [m], NaN outside `low` to `high`. Raises PlugInError when it fails, or for a shape."""
        with blaming("noise model", self.name, "scan"):
            answer = self.inner.scan(ranges.copy(), random)
        seen = copied(f"{self.name}: the noise model", "scan", answer, ranges.shape)
        return np.where((seen >= low) & (seen < high), seen, np.nan)

    def pose(self, pose: np.ndarray, random: np.random.Generator) -> np.ndarray:
        """Return a pose (3,). Raises PlugInError when it fails, or for another shape."""
        with blaming("noise model", self.name, "pose"):
            answer = self.inner.pose(pose.copy(), random)
        return copied(f"{self.name}: the noise model", "pose", answer, (3,))
