"""Perception run over time without a plant: scenes are ray-cast, and `sensing` adds its noise."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.perceive import PerceptionMemory, initial, perceive
from pbrg_mj.perception.setup import PerceptionSetup, perception_setup
from pbrg_mj.scenario.random_streams import Source, stream
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.sensing.beam_model import noisy_scan
from pbrg_mj.sensing.noise import SensorNoise, sensor_noise
from pbrg_mj.sensing.readings import Readings
from tests.raycast import Scene, cast

CLEARANCE, HAND = 0.1, 0.04
BEAMS, PERIOD = 72, 0.1  # [s]
PENTAGON = ((-0.5, 0.5), (-0.5, -0.5), (0.0, -0.5), (0.5, -0.5), (0.0, 0.0))


def scenario(formation: tuple[tuple[float, float], ...] = ((0.0, 0.0),), **sections: Any) -> Scenario:
    team = {"start": [(3.0 * k, 0.0) for k in range(len(formation))], "formation": formation, "leaders": [1]}
    return Scenario.model_validate({"team": team, "operator": {"reference": (0, 0)}, **sections})


def setup(given: Scenario) -> PerceptionSetup:
    return perception_setup(given, CLEARANCE, HAND)


def readings(scenes: list[Scene], poses: np.ndarray, noise: SensorNoise, frame: int) -> Readings:
    """What robots see at true `poses` (n, 3), each in a scene of its own, with the noise of `sensing`."""
    rows, seen = [], []
    for robot, (scene, pose) in enumerate(zip(scenes, poses, strict=True)):
        raw = cast(scene, pose, BEAMS, noise.range_max)
        rows.append(noisy_scan(np.nan_to_num(raw, nan=-1.0), noise, stream(noise.seed, Source.BEAMS, robot, frame)))
        draw = stream(noise.seed, Source.CAMERA, robot, frame).standard_normal(3)
        seen.append(pose + draw * [noise.position_std, noise.position_std, noise.heading_std])
    return Readings(np.array(seen), np.array(rows), True, 0, 0)


def walk(
    given: Scenario, scene: Callable[[float], Scene | list[Scene]], pose: Callable[[float], Any], scans: int
) -> Iterator[tuple[float, np.ndarray, HalfSpaces, PerceptionMemory]]:
    """Scan after scan: the time, the true poses (n, 3), what is known, and the memory behind it."""
    config, noise = setup(given), sensor_noise(given)
    memory = initial(config)
    for k in range(scans):
        time = k * PERIOD
        poses = np.atleast_2d(np.array(pose(time), dtype=float))
        scenes = scene(time)
        scenes = scenes if isinstance(scenes, list) else [scenes] * len(poses)
        known, memory = perceive(readings(scenes, poses, noise, k), time, memory, config)
        yield time, poses, known, memory


def box(x: float, y: float, width: float, height: float | None = None, angle: float = 0.0) -> Scene:
    """Four faces of a box about (x, y) [m]."""
    a, b = width / 2, (height or width) / 2
    return Scene(((-a, -b, a, -b), (a, -b, a, b), (a, b, -a, b), (-a, b, -a, -b))).moved(x, y, angle)


def together(*scenes: Scene) -> Scene:
    return Scene(sum((s.segments for s in scenes), ()), sum((s.discs for s in scenes), ()))


def rows(known: HalfSpaces, robot: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Active G (k, 2) and h (k,) of a robot."""
    on = known.active[robot]
    return known.G[robot, on], known.h[robot, on]
