"""One robot at random free places in random worlds: what it has seen after three scans, and what points make of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from statistics import median
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from accuracy.raycast import Scene, cast
from regions.measures import Region
from regions.places import Places, places_of

from pbrg_mj.analysis.metrics.obstacles import footprints, outlines
from pbrg_mj.perception.points.estimator import PointEstimator, PointMemory
from pbrg_mj.perception.points.face import next_face
from pbrg_mj.perception.points.known_free import Edge
from pbrg_mj.perception.points.lines import no_lines
from pbrg_mj.perception.points.obstacle_points import (
    ObstaclePoints,
    empty_points,
    free_path,
    measure_from,
    obstacle_points,
)
from pbrg_mj.perception.points.parameters import point_parameters
from pbrg_mj.perception.points.separate import separate
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.random_streams import Source, stream
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.sensing.beam_model import noisy_scan
from pbrg_mj.sensing.noise import sensor_noise
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.world.scene.footprints import Footprints, wall_margin
from pbrg_mj.world.scene.robot import load_robot_model

ROBOT = load_robot_model()
SCANS = 3  # at rest: what binds after a second and a third look is then told too
WITHIN = 2.5  # [m] of a world's origin, in x and in y
FREE = 0.05  # [m] more than the clearance between the hand point and what is solid
FAR = 2.0  # [m] to the target
REPEATS = 9  # of what is timed
NO_EDGE = Edge(np.empty(0), np.empty(0), np.empty(0))


class View(NamedTuple):
    """What a robot knows, where it is, and what is there."""

    name: str
    solids: Footprints
    hand: np.ndarray  # (2,) as the camera tells it [m]
    target: np.ndarray  # (2,) [m]
    reach: float  # of the sensor [m]
    places: Places  # echoes that bind
    clusters: list[np.ndarray]  # indices of the places of each
    path: np.ndarray  # (2, 2) the way to the target as far as it is free [m]
    ours: Region
    finer: Region  # ours with sixteen slots
    seconds: float  # that ours took


def view(name: str, solids: Footprints, seed: list[int], sensor: str) -> View:
    """Return what a robot makes of a world at a random free place, looking at a random target."""
    random = np.random.default_rng(seed)
    given = scenario(sensor, int(random.integers(2**31)))
    pose, target = free_pose(solids, random)
    made, finer = estimator(given, 8), estimator(given, 16)
    memory = finer_memory = made.init()
    finer_memory = finer.init()
    scene, readings = scene_of(solids), None
    for frame in range(SCANS):
        readings = scan(given, scene, pose, frame)
        time = frame / given.sensors.beams.rate_hz
        _, memory = made.step_towards(readings, time, memory, target[None])
        _, finer_memory = finer.step_towards(readings, time, finer_memory, target[None])
    assert readings is not None
    hand = hand_of(readings.body_pose[0])
    places, clusters, path = seen(memory, hand, target, made)
    region = active(memory), active(finer_memory)
    seconds = timed(memory, hand, target, made)
    reach = given.sensors.beams.range_max
    return View(name, solids, hand, target, reach, places, clusters, path, *region, seconds)


@cache
def family_world(name: str, seed: int) -> Footprints:
    """Return what stands still in a world of a family."""
    return footprints(load_scenario(name, [f"seed={seed}"]).scenario)


def scenario(sensor: str, seed: int) -> Scenario:
    """Return one robot with a preset's beams."""
    return Scenario.model_validate(
        {
            "seed": seed,
            "team": {"start": [(0, 0)], "formation": [(0, 0)], "leaders": [1]},
            "operator": {"reference": (0, 0)},
            "sensors": {"beams": {"preset": sensor}},
            "estimator": {"source": "points"},
        }
    )


def estimator(given: Scenario, slots: int) -> PointEstimator:
    return PointEstimator(point_parameters(given, ROBOT), np.zeros(1, dtype=np.int64), np.zeros((1, 2)), slots)


def free_pose(solids: Footprints, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return a pose (3,) whose hand point and body are free, and a target (2,) in any direction of it."""
    while True:
        pose = random.uniform([-WITHIN, -WITHIN, -np.pi], [WITHIN, WITHIN, np.pi])
        course = random.uniform(-np.pi, np.pi)
        hand = hand_of(pose)
        fits = wall_margin(np.array([hand, pose[:2]]), solids, ROBOT.clearance)
        if fits[0] > FREE and fits[1] > ROBOT.body_radius - ROBOT.clearance:
            return pose, hand + FAR * np.array([np.cos(course), np.sin(course)])


def hand_of(pose: np.ndarray) -> np.ndarray:
    return pose[:2] + ROBOT.hand_offset * np.array([np.cos(pose[2]), np.sin(pose[2])])


def scene_of(solids: Footprints) -> Scene:
    """Return the same solids for the ray-caster: columns stay round."""
    round_ones = np.flatnonzero(solids.radius > 0.0)
    flat = [corners for k, corners in enumerate(outlines(solids)) if k not in round_ones]
    closed = [np.concatenate([corners, corners[:1]]).tolist() for corners in flat]
    discs = tuple((*solids.centre[k].tolist(), float(solids.radius[k])) for k in round_ones)
    return Scene(tuple((*a, *b) for corners in closed for a, b in pairwise(corners)), discs)


def scan(given: Scenario, scene: Scene, pose: np.ndarray, frame: int) -> Readings:
    """Return what the robot reads at a true pose (3,)."""
    noise, beams = sensor_noise(given), given.sensors.beams
    raw = np.nan_to_num(cast(scene, pose, beams.count, beams.range_max), nan=-1.0)
    raw[raw < beams.range_min] = -1.0
    ranges = noisy_scan(raw, noise, stream(noise.seed, Source.BEAMS, 0, frame))
    draw = stream(noise.seed, Source.CAMERA, 0, frame).standard_normal(3)
    told = pose + draw * [noise.position_std, noise.position_std, noise.heading_std]
    return Readings(told[None], ranges[None], True, 3 * frame, frame)


def active(memory: PointMemory) -> Region:
    known = memory.half_spaces
    return Region(known.G[0][known.active[0]], known.h[0][known.active[0]])


def seen(
    memory: PointMemory, hand: np.ndarray, target: np.ndarray, made: PointEstimator
) -> tuple[Places, list[np.ndarray], np.ndarray]:
    """Return the places that bind, clusters of them, and the path as far as it is free.

    Clusters are our faces, one after the other from the path outwards, but that each takes its own places away and no
    others: the nearest place and those around it whose hull leaves the path enough room.
    """
    parameters = made.parameters
    found, count = obstacle_points(memory.points[0], NO_EDGE, parameters)
    free = free_path(found, count, hand, target, parameters)
    measure_from(free, found, count)
    index = {(x, y): k for k, (x, y) in enumerate(zip(found.x[:count].tolist(), found.y[:count].tolist(), strict=True))}
    left, window, clusters = sorted(index.values()), empty_points(count, memory.points[0]), []
    while left:
        rest = ObstaclePoints(*(array[left] for array in found[:-1]), found.memory)
        size = next_face(rest, len(left), window, free)[0]
        if size == 0:
            break
        taken = {index[at] for at in zip(window.x[:size].tolist(), window.y[:size].tolist(), strict=True)}
        clusters.append(np.array(sorted(taken)))
        left = [k for k in left if k not in taken]
    return places_of(found, count, parameters), clusters, np.array(free).reshape(2, 2)


def timed(memory: PointMemory, hand: np.ndarray, target: np.ndarray, made: PointEstimator) -> float:
    """Return the median time [s] of making half-spaces of the places."""
    known = memory.half_spaces
    slots = known.h.shape[1]
    before = known.G[0], known.h[0], known.active[0], np.empty((slots, 2)), no_lines(slots)
    inputs = [tuple(array.copy() for array in before) for _ in range(REPEATS)]
    return repeated(
        [lambda one=one: separate((memory.points[0], NO_EDGE), hand, target, made.parameters, one) for one in inputs]
    )


def repeated(calls: list[Callable[[], Any]]) -> float:
    """Return the median time [s] of calls."""
    spent = []
    for call in calls:
        began = process_time()
        call()
        spent.append(process_time() - began)
    return median(spent) if spent else math.nan
