"""Noisy scans of scenes with robots in them, for the tests of perception."""

from dataclasses import dataclass

import numpy as np

from pbrg_mj.perception.scan.parameters import LineParameters, line_parameters
from pbrg_mj.scenario.schema import PRESETS, Beams, Scenario, ray_angles
from tests.raycast import Scene, cast_along

SENSORS = ("generic", *PRESETS)


def cast_cones(scene: Scene, pose: np.ndarray, beams: Beams) -> np.ndarray:
    """Exact ranges (beams,) [m] from `pose` (3,), of the nearest of each beam's rays; NaN for no hit."""
    ranges = cast_along(scene, pose, ray_angles(beams), beams.range_max).reshape(beams.count, beams.rays)
    return np.fmin.reduce(ranges, axis=1)


@dataclass(frozen=True)
class Sensor:
    """A beam sensor, its parameters, and its beams."""

    beams: Beams
    params: LineParameters
    directions: np.ndarray

    def look(self, scene: Scene, pose: np.ndarray, random: np.random.Generator | None) -> np.ndarray:
        """A scan from `pose`, with the sensor's noise unless `random` is None."""
        exact = cast_cones(scene, pose, self.beams)
        return exact if random is None else self.disturb(exact, random)

    def disturb(self, exact: np.ndarray, random: np.random.Generator) -> np.ndarray:
        beams, count = self.beams, len(exact)
        std = np.hypot(beams.noise_std, beams.noise_ratio * np.nan_to_num(exact))
        ranges = exact + std * random.standard_normal(count)
        if beams.quantum > 0:
            ranges = beams.quantum * np.round(ranges / beams.quantum)
        ranges[~((ranges >= beams.range_min) & (ranges < beams.range_max))] = np.nan
        ranges[random.random(count) < beams.dropout] = np.nan
        stray = random.random(count) < beams.outliers
        ranges[stray] = random.uniform(beams.range_min, beams.range_max, stray.sum())
        return ranges


def sensor(preset: str = "generic", **keys: object) -> Sensor:
    scenario = Scenario.model_validate(
        {
            "team": {"start": [(0, 0), (1, 0)], "formation": [(0, 0), (1, 0)], "leaders": [1]},
            "operator": {"reference": (0, 0)},
            "sensors": {"beams": {"preset": preset, **keys}},
        }
    )
    beams = scenario.sensors.beams
    angle = 2 * np.pi * np.arange(beams.count) / beams.count
    return Sensor(beams, line_parameters(scenario, 0.1), np.column_stack([np.cos(angle), np.sin(angle)]))


def four_robots(random: np.random.Generator, reach: float = 1.5) -> tuple[tuple[float, float, float], ...]:
    """Four discs around the origin that keep a few centimetres from one another and from a robot there."""
    discs: list[tuple[float, float, float]] = []
    while len(discs) < 4:
        x, y = random.uniform(-reach, reach, 2).tolist()
        if all(np.hypot(x - a, y - b) > 0.16 for a, b, _ in [(0.0, 0.0, 0.0), *discs]):
            discs.append((x, y, float(random.uniform(0.043, 0.06))))
    return tuple(discs)


def planted(angle: float, offset: float, left: float, right: float) -> Scene:
    """A wall with the given normal angle and offset from the origin, between two places along it."""
    n, t = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    return Scene(((*(offset * n + left * t), *(offset * n + right * t)),))
