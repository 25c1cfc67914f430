"""Where walls are put: a wall of 3 m at a range and incidence, a robot at rest before it, ten scans."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from raycast import Scene
from scanning_robot import CLEARANCE, HAND, PLATES, ScanningRobot, scenario
from scipy.stats import chi2

RANGES, INCIDENCES = (0.5, 1.0, 1.5, 2.0, 2.5), (0, 30, 60)  # [m] to the wall's middle, [deg] from its normal
WALL, SCANS = 3.0, 10  # length of the wall [m]; scans that are fused
SEEDS = 100_000  # most seeds of a cell: each cell has noise of its own
ANGLE, OFFSET, SQUARE, OUTSIDE, BINDS = range(5)


class Cell(NamedTuple):
    """A sensor before a wall."""

    sensor: str
    distance: float
    incidence: int
    min_points: int = 5
    height: float = PLATES  # of the beams [m]

    @property
    def number(self) -> int:
        return 1 + RANGES.index(self.distance) * len(INCIDENCES) + INCIDENCES.index(self.incidence)

    def __str__(self) -> str:
        return f"{self.distance} m, {self.incidence} deg"


def place(cell: Cell, seed: int) -> np.ndarray:
    """Rows (SCANS, 5): angle error [rad], offset error [m], squared normalised error, outside, binds."""
    scanner = ScanningRobot(scenario(cell.sensor, cell.number * SEEDS + seed, cell.height, min_points=cell.min_points))
    angle, random = np.deg2rad(cell.incidence), np.random.default_rng([seed, cell.number])
    normal, tangent = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    a, b = (np.array([cell.distance, 0.0]) + s * WALL / 2 * tangent for s in (-1, 1))
    pose = np.array([0.0, 0.0, random.uniform(-np.pi, np.pi)])
    scene, hand = Scene(((*a, *b),)), HAND * np.array([np.cos(pose[2]), np.sin(pose[2])])
    along = np.clip((hand - a) @ tangent, 0.0, WALL)
    room = float(np.linalg.norm(hand - a - along * tangent)) - CLEARANCE
    rows = np.full((SCANS, 5), np.nan)
    for row in rows:
        scanner.scan(scene, pose)
        if len(scanner.tracks):
            # The wall, if it was seen in parts.
            best = max(scanner.tracks, key=lambda t: (t["hits"], t["high"] - t["low"]))
            row[[ANGLE, OFFSET, SQUARE]] = scanner.errors(best, normal, cell.distance * np.cos(angle))
        row[OUTSIDE] = _slack(scanner, hand) > room if scanner.binds() else np.nan
        row[BINDS] = scanner.binds()
    return rows


def _slack(scanner: ScanningRobot, hand: np.ndarray) -> float:
    known = scanner.memory.half_spaces
    return float((known.h[0] - known.G[0] @ hand)[known.active[0]].min())


def figures(rows: np.ndarray) -> dict[str, float]:
    """Figures of one cell from (seeds, SCANS, 5)."""
    result: dict[str, float] = {"recall": float(np.mean(rows[:, -1, BINDS]))}
    for name, k in (("single", 0), ("fused", SCANS - 1)):
        some = rows[np.isfinite(rows[:, k, ANGLE]), k]
        if len(some) < 10:
            continue
        error = some[:, [ANGLE, OFFSET]] * [180 / np.pi, 1.0]
        for unit, value, bias in zip(
            ("angle_{}_deg", "offset_{}_m"), np.sqrt((error**2).mean(0)), error.mean(0), strict=True
        ):
            result[f"{name}_{unit.format('rms')}"], result[f"{name}_{unit.format('bias')}"] = float(value), float(bias)
        result[f"{name}_nees"], result[f"{name}_nees_of"] = float(some[:, SQUARE].mean()), len(some)
        low, high = band(len(some))
        result[f"{name}_nees_in_band"] = low <= result[f"{name}_nees"] <= high
    return result


def band(count: int) -> tuple[float, float]:
    """The 95 % band of the mean of `count` squared normalised errors with two degrees of freedom each."""
    low, high = chi2.ppf([0.025, 0.975], 2 * count) / count
    return float(low), float(high)


def pooled(cells: dict[str, dict[str, float]], name: str) -> dict[str, float]:
    """Consistency of all cells of a sensor together; NaN where it made no line."""
    some = [c for c in cells.values() if f"{name}_nees" in c]
    count = int(sum(c[f"{name}_nees_of"] for c in some))
    if count == 0:
        return {"inside": 0, "cells": 0, "mean": np.nan, "low": np.nan, "high": np.nan}
    mean = sum(c[f"{name}_nees"] * c[f"{name}_nees_of"] for c in some) / count
    low, high = band(count)
    inside = sum(c[f"{name}_nees_in_band"] for c in some)
    return {"inside": inside, "cells": len(some), "mean": mean, "low": low, "high": high}
