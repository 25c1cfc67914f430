"""The walls a robot remembers: which sighting is which wall, and which slot it holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.perception.frames import WorldLine

ANGLE_GATE = np.deg2rad(10.0)
OFFSET_GATE = 0.15  # [m] of the sighting's middle from the remembered line
SLACK = 1e-9  # [s] rounding of the clock


@dataclass(frozen=True)
class RememberedWall:
    """A wall as last seen."""

    line: WorldLine
    seen: float  # time of the last sighting [s]


Slots = tuple[RememberedWall | None, ...]  # of one robot


def remember(slots: Slots, sightings: list[WorldLine], position: np.ndarray, now: float) -> Slots:
    """Return the slots after one scan at time `now` [s]; `position` (2,) [m] is the robot's.

    A wall seen again keeps its slot and takes the new line. New walls fill free slots, nearest first, and when there
    are none they displace the farthest wall, if that is farther away than they are.
    """
    result = list(slots)
    new: list[WorldLine] = []
    free = {index for index, wall in enumerate(slots) if wall is not None}
    for line in sightings:
        index = _match(line, slots, free)
        if index is None:
            new.append(line)
        else:
            free.discard(index)
            result[index] = RememberedWall(line, now)
    for line in sorted(new, key=lambda line: line.distance):
        distances = [np.inf if wall is None else _distance(wall.line, position) for wall in result]
        farthest = int(np.argmax(distances))
        if line.distance < distances[farthest]:
            result[farthest] = RememberedWall(line, now)
    return tuple(result)


def forget(slots: Slots, now: float, memory: float) -> Slots:
    """Return the slots without the walls that have been out of sight for longer than `memory` [s]."""
    return tuple(wall if wall and now - wall.seen <= memory + SLACK else None for wall in slots)


def _match(line: WorldLine, slots: Slots, free: set[int]) -> int | None:
    """Return the slot among `free` whose wall this is: the nearest within the gates, or None."""
    best, best_cost = None, 2.0
    for index in sorted(free):
        wall = slots[index]
        assert wall is not None
        turn = abs(np.remainder(line.angle - wall.line.angle + np.pi, 2 * np.pi) - np.pi) / ANGLE_GATE
        shift = abs(float(wall.line.normal @ line.middle) - wall.line.offset) / OFFSET_GATE
        if turn <= 1 and shift <= 1 and turn + shift < best_cost:
            best, best_cost = index, turn + shift
    return best


def _distance(line: WorldLine, position: np.ndarray) -> float:
    return line.offset - float(line.normal @ position)
