"""Walls, boxes and patches by themselves: each has an extent, and moving boxes move on in time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from pbrg_mj.scenario.findings import Finding
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.scenario.surroundings import MovingBox
from pbrg_mj.scenario.words import Path, show

SHORTEST = 1e-6  # side of anything [m]


def things(scenario: Scenario) -> Iterator[Finding]:
    """Yield walls without length, boxes and patches without area, and stops out of order."""
    world = scenario.world
    for k, wall in enumerate(world.walls):
        if math.dist(wall.start, wall.end) < SHORTEST:
            told = f"runs from {show(wall.start)} to {show(wall.end)}; allowed: two different points"
            yield Finding(("world", "walls", k), told)
    for name, boxes in (("boxes", world.boxes), ("moving_boxes", world.moving_boxes)):
        for k, box in enumerate(boxes):
            if min(box.size) < SHORTEST:
                path = ("world", name, k, "size")
                yield Finding(path, f"is {show(box.size)}; allowed: at least {SHORTEST} m either way")
    for k, box in enumerate(world.moving_boxes):
        yield from _stops(("world", "moving_boxes", k, "stops"), box)
    for k, patch in enumerate(world.patches):
        if min(abs(a - b) for a, b in zip(patch.start, patch.end, strict=True)) < SHORTEST:
            told = f"reaches from {show(patch.start)} to {show(patch.end)}; allowed: corners apart along x and along y"
            yield Finding(("world", "patches", k), told)


def _stops(path: Path, box: MovingBox) -> Iterator[Finding]:
    for k, (before, after) in enumerate(pairwise(box.stops), start=1):
        if after.time <= before.time:
            told = f"is {after.time} s; allowed: later than the one before, {before.time} s"
            yield Finding((*path, k, "time"), told)
