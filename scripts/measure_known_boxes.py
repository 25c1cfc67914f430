"""How often robots touch moving boxes that they know perfectly, in worlds of `measure_other_worlds.py`.

python scripts/measure_known_boxes.py 6226-8900 [within=0.03] [processes=2]   # docs/worlds.md

In place of the half-spaces that a robot has made of a moving box it gets, in every tick, that of the box's nearest
point, with the speed at which it comes and the span of the box, whatever stands between. All else is perceived. What is
left of contacts is what the control of velocities, wheels and the worlds leave no other way. Worlds that are within so
many metres of touching a line in docs/data/other_worlds.json run, those that are there.
"""

from __future__ import annotations

import multiprocessing
import sys
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from measure_other_worlds import COLUMNS, loaded, read

from pbrg_mj.api.seeds import seeds_of
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.points.estimator import PointEstimator, PointMemory
from pbrg_mj.scenario.schema import MovingBox
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.world.plant.interface import Plant
from pbrg_mj.world.scene.footprints import Footprints, signed_distance
from pbrg_mj.world.scene.obstacles import moving_footprints

RANGE, NEAR = 1.5, 0.15  # [m] of what is known, and from a box within which the face of a half-space is the box's
STEP, INSTANT = 1e-4, 0.02  # [m], [s] of differences


@dataclass(frozen=True)
class KnownBoxes:
    """The point estimator, but what it makes of moving boxes is replaced by what they are."""

    points: PointEstimator
    world: Plant
    boxes: tuple[MovingBox, ...]

    def init(self) -> PointMemory:
        """Return a memory of nothing."""
        return self.points.init()

    def step(self, readings: Readings, time: float, memory: PointMemory) -> tuple[HalfSpaces, PointMemory]:
        """Do what `step_towards` does for robots that stay where they are."""
        return self.step_towards(readings, time, memory, None)

    def step_towards(
        self, readings: Readings, time: float, memory: PointMemory, m: np.ndarray | None
    ) -> tuple[HalfSpaces, PointMemory]:
        """Return the half-spaces every robot knows at `time` [s], and the estimator's own memory."""
        known, memory = self.points.step_towards(readings, time, memory, m)
        G, h, active, binds, closing, spans = (np.array(one) for one in known.arrays)
        for j, q in enumerate(self.world.truth().hand_world):
            boxes = [(box, moving_footprints([box], time)) for box in self.boxes]
            near = [pair for pair in boxes if signed_distance(q[None], pair[1]).min() < RANGE]
            for k in np.flatnonzero(active[j]):
                face = q + G[j, k] * (h[j, k] + self.points.parameters.clearance - G[j, k] @ q)
                if closing[j, k] > 0.0 or any(signed_distance(face[None], one).min() < NEAR for _, one in near):
                    active[j, k], binds[j, k], closing[j, k] = False, False, 0.0
            free = np.flatnonzero(~active[j])
            for k, (box, now) in zip(free, near, strict=False):  # as many as there are slots
                G[j, k], h[j, k], closing[j, k], spans[j, k] = self._half_space(box, now, q, time)
                active[j, k] = binds[j, k, j] = True
        return HalfSpaces(G, h, active, binds, closing, spans), memory

    def _half_space(self, box: MovingBox, now: Footprints, q: np.ndarray, time: float) -> tuple[Any, ...]:
        """Return G (2,), h [m], closing [m/s] and span (2,) [m] of a box for a hand point q (2,) [m]."""
        clearance, reaction = self.points.parameters.clearance, self.points.parameters.reaction
        around = q + STEP * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
        here, right, left, up, down = signed_distance(around, now).min(axis=1)
        G = np.array([left - right, down - up])
        G /= np.linalg.norm(G)
        before = signed_distance(q[None], moving_footprints([box], max(time - INSTANT, 0.0))).min()
        closing = max(before - here, 0.0) / INSTANT
        aside = np.array([-G[1], G[0]])
        half = now.half_size[0] * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
        corners = now.centre[0] + half[:, :1] * now.axis[0] + half[:, 1:] * [-now.axis[0, 1], now.axis[0, 0]]
        along = corners @ aside
        span = (along.min() - clearance, along.max() + clearance) if closing > 0.0 else (0.0, 0.0)
        return G, G @ q + here - clearance - reaction * closing, closing, span


def run(seed: int) -> tuple[int, bool, bool]:
    """Return the seed, whether some robot touches a moving box and whether one passes the line of one."""
    scenario = loaded("moving", seed).settings
    none = scenario.reference.model_copy(update={"solver": "none"})
    simulation = Simulation.build(scenario.model_copy(update={"reference": none}))
    points = simulation.loop.estimator
    if not isinstance(points, PointEstimator):
        raise TypeError("the recommended set-up of these worlds has points")
    estimator = KnownBoxes(points, simulation.loop.world, tuple(scenario.world.moving_boxes))
    simulation, touched, margin = replace(simulation, loop=replace(simulation.loop, estimator=estimator)), False, np.inf
    for _ in simulation.control_ticks():
        truth = simulation.loop.world.truth()
        touched, margin = touched or bool(truth.moving_contact.any()), min(margin, float(truth.moving_margin.min()))
    return seed, touched, margin < 0.0


def main(arguments: list[str]) -> None:
    keys = dict(one.split("=", 1) for one in arguments[1:])
    worlds, within = read()["moving"], float(keys.get("within", "inf"))
    margin, event = COLUMNS.index("moving_margin_m"), COLUMNS.index("touching_moving")
    seeds = [seed for seed in seeds_of(arguments[0]) if str(seed) in worlds]
    seeds = [seed for seed in seeds if (least := worlds[str(seed)][margin]) is not None and least < within]
    found = []
    with multiprocessing.get_context("spawn").Pool(int(keys.get("processes", 1))) as pool:
        for count, one in enumerate(pool.imap_unordered(run, seeds), 1):
            found.append(one)
            print(f"\r{count} of {len(seeds)}", end="", file=sys.stderr)
    perceived = [(seed, worlds[str(seed)][event] > 0, worlds[str(seed)][margin] < 0.0) for seed in seeds]
    for name, rows in (("perceived", perceived), ("known", sorted(found))):
        touching = [seed for seed, touches, _ in rows if touches]
        print(
            f"\n{name}: touches a moving box in {len(touching)}, past its line in {sum(row[2] for row in rows)}", end=""
        )
        print(f" of {len(rows)} worlds; touches in {', '.join(map(str, touching)) or 'none'}", end="")
    print()


if __name__ == "__main__":
    main(sys.argv[1:])
