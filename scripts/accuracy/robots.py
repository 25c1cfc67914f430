"""Where there is more than walls: robots that move before one, and robots abreast that do not move."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from raycast import PLATE, Scene, robot
from scanning_robot import PLATES, ScanningRobot, scenario
from scipy.stats import chi2

ROBOTS, RADIUS, GAP = 4, PLATE, 0.02  # robots, their radius and the least gap between things [m]
NEAREST, FARTHEST, WALL = 0.16, 1.8, 2.0  # of centres from the robot that scans; of the wall [m]
SPEEDS = (0.05, 0.3)  # [m/s]
SCANS = 50  # per seed
GATE = float(chi2.isf(1e-6, 2))  # one honest track of the wall in a million is beyond
ALIKE_ANGLE, ALIKE_OFFSET = 0.2, 0.2  # [rad], [m] beyond which a track is not the wall's, however unsure it is
SPACINGS = ((0.13, 0.3), (0.3, 0.5))  # between robots abreast [m]


def false_walls(sensor: str, seed: int, height: float = PLATES) -> int:
    """Tracks that count as walls and are not the wall, over SCANS scans of it and of robots that move before it."""
    scanner, random = ScanningRobot(scenario(sensor, seed, height)), np.random.default_rng([seed, 7])
    pose, count = np.array([0.0, 0.0, random.uniform(-np.pi, np.pi)]), 0
    for poses in crowd(random, SCANS, scanner.period):
        scanner.scan(_robots(poses, height, Scene(((WALL, -4.0, WALL, 4.0),))), pose)
        count += sum(not _is_wall(scanner, track) for track in scanner.tracks if track["confirmed"])
    return count


def _is_wall(scanner: ScanningRobot, track: np.void) -> bool:
    turn, off, square = scanner.errors(track, np.array([1.0, 0.0]), WALL)
    return abs(turn) < ALIKE_ANGLE and abs(off) < ALIKE_OFFSET and square < GATE


def _robots(poses: np.ndarray, height: float, before: Scene) -> Scene:
    return sum((robot(pose, height) for pose in poses), before)


def crowd(random: np.random.Generator, scans: int, period: float) -> Iterator[np.ndarray]:
    """Poses (ROBOTS, 3) scan after scan: always all in view, apart and before the wall.

    A robot heads where it goes. It keeps its speed and way until it would get in another's way, or out of sight; then
    it takes others.
    """
    places = _start(random)
    ways = np.array([_way(random) for _ in range(ROBOTS)])
    for _ in range(scans):
        yield np.column_stack([places, np.arctan2(ways[:, 1], ways[:, 0])])
        for i in range(ROBOTS):
            for _try in range(20):
                moved = places.copy()
                moved[i] += period * ways[i]
                if visible(moved):
                    places = moved
                    break
                ways[i] = _way(random)


def _start(random: np.random.Generator) -> np.ndarray:
    while True:
        places = random.uniform(-FARTHEST, FARTHEST, (ROBOTS, 2))
        if visible(places):
            return places


def _way(random: np.random.Generator) -> np.ndarray:
    speed, angle = random.uniform(*SPEEDS), random.uniform(-np.pi, np.pi)
    return speed * np.array([np.cos(angle), np.sin(angle)])


def visible(places: np.ndarray) -> bool:
    """Tell whether all robots are in range, before the wall, apart, and none hides another's middle."""
    distance = np.linalg.norm(places, axis=1)
    if np.any((distance < NEAREST) | (distance > FARTHEST) | (places[:, 0] > WALL - RADIUS - GAP)):
        return False
    for i in range(ROBOTS):
        for j in range(ROBOTS):
            if i == j:
                continue
            along = np.clip(places[j] @ places[i] / distance[i] ** 2, 0.0, 1.0)
            if np.linalg.norm(places[j] - places[i]) < 2 * RADIUS + GAP or (
                distance[j] < distance[i] and np.linalg.norm(places[j] - along * places[i]) < RADIUS
            ):
                return False
    return True


def row_binds(sensor: str, min_points: int, spacing: tuple[float, float], seed: int, height: float = PLATES) -> bool:
    """Whether robots in a row, at rest for SCANS scans, are ever taken for a wall.

    They are in line ahead, so that low beams see the flats of their wheels along one line.
    """
    scanner = ScanningRobot(scenario(sensor, seed, height, min_points=min_points))
    random = np.random.default_rng([seed, 11])
    middle, turn = np.array([random.uniform(0.4, 1.6), random.uniform(-0.3, 0.3)]), random.uniform(-0.5, 0.5)
    step = random.uniform(*spacing) * np.array([-np.sin(turn), np.cos(turn)])
    places = middle + (np.arange(ROBOTS) - (ROBOTS - 1) / 2)[:, None] * step
    poses = np.column_stack([places, np.full(ROBOTS, np.arctan2(step[1], step[0]))])
    pose, bound = np.array([0.0, 0.0, random.uniform(-np.pi, np.pi)]), False
    for _ in range(SCANS):
        scanner.scan(_robots(poses, height, Scene()), pose)
        bound = bound or scanner.binds()
    return bound
