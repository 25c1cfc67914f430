"""One tick of perception: scans to walls to half-spaces."""

from __future__ import annotations

from dataclasses import dataclass

from pbrg_mj.perception.frames import to_world
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.memory import Slots, forget, remember
from pbrg_mj.perception.setup import PerceptionSetup
from pbrg_mj.perception.walls import find_walls
from pbrg_mj.sensing.readings import Readings


@dataclass(frozen=True)
class PerceptionMemory:
    """What is kept from tick to tick: every robot's walls, and the half-spaces made of them."""

    walls: tuple[Slots, ...]  # one per robot
    half_spaces: HalfSpaces


def initial(setup: PerceptionSetup) -> PerceptionMemory:
    """Return the memory before the first tick: the given half-spaces, or none."""
    walls: tuple[Slots, ...] = ((None,) * setup.slots,) * setup.robots
    return PerceptionMemory(walls, setup.given or HalfSpaces.empty(setup.robots, setup.slots))


def perceive(
    readings: Readings, time: float, memory: PerceptionMemory, setup: PerceptionSetup
) -> tuple[HalfSpaces, PerceptionMemory]:
    """Return the half-spaces every robot knows at `time` [s], for hand points in the world, and the new memory.

    They change with a new scan only. A half-space is a fitted wall moved towards the robot by the clearance: a robot
    that stands nearer to the wall than that lies outside its own half-space, and the caller sees it so.
    """
    if setup.given is not None or not readings.new_scan:
        return memory.half_spaces, memory
    walls = list(memory.walls)
    for ranges, robot in zip(readings.ranges, setup.beam_robots, strict=True):
        pose = readings.body_pose[robot]
        lines = find_walls(ranges, setup.directions, setup.rules)
        sightings = [to_world(line, pose, setup.pose_noise) for line in lines]
        walls[robot] = remember(forget(walls[robot], time, setup.memory), sightings, pose[:2], time)
    half_spaces = to_half_spaces(tuple(walls), setup.slots, setup.clearance)
    return half_spaces, PerceptionMemory(tuple(walls), half_spaces)


def to_half_spaces(walls: tuple[Slots, ...], slots: int, clearance: float) -> HalfSpaces:
    """Return G q <= h for hand points: every remembered face, moved inward by `clearance` [m]."""
    result = HalfSpaces.empty(len(walls), slots)
    for robot, kept in enumerate(walls):
        for slot, wall in enumerate(kept):
            if wall is not None:
                result.G[robot, slot] = wall.line.normal
                result.h[robot, slot] = wall.line.offset - clearance
                result.active[robot, slot] = result.binds[robot, slot] = True
    return result
