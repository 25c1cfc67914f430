"""Noise of another package in place of ours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pbrg_mj.plugin_calls import copied, plug_in_errors, read_only_copy, within

FARTHEST = 1e9  # [m] of a pose, and rad of a heading


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
    limit: float | None = None  # of a call [s]

    def scan(self, ranges: np.ndarray, random: np.random.Generator, low: float, high: float) -> np.ndarray:
        """Return a scan (beams,) [m], NaN outside `low` to `high`. Raises PlugInError when it fails, or for a shape."""
        with plug_in_errors("noise model", self.name, "scan", self.limit):
            answer = self.inner.scan(read_only_copy(ranges), random)
        seen = copied(f"{self.name}: the noise model", "scan", answer, ranges.shape)
        return np.where((seen >= low) & (seen < high), seen, np.nan)

    def pose(self, pose: np.ndarray, random: np.random.Generator) -> np.ndarray:
        """Return a pose (3,). Raises PlugInError when it fails, for another shape and what is not finite."""
        with plug_in_errors("noise model", self.name, "pose", self.limit):
            answer = self.inner.pose(read_only_copy(pose), random)
        whose = f"{self.name}: the noise model"
        found = copied(whose, "pose", answer, (3,))
        within(whose, "pose", found, FARTHEST)
        return found
