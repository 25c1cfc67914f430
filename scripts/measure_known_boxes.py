"""How often robots touch moving boxes of which they know more, or less, than they perceive.

python scripts/measure_known_boxes.py 6226-8900 within=0.03 processes=2   # docs/worlds.md
python scripts/measure_known_boxes.py 9729,21084 noise=5-10 know=nothing,speeds,boxes
python scripts/measure_known_boxes.py 30001-30220 more=5 know=nothing

Worlds are those of `measure_other_worlds.py`; with `within` those that are within so many metres of touching a line in
docs/data/other_worlds.json. `noise` are other seeds of the noise, each a run of its own of the same world: a world in
which a contact was seen need not have one with them. `more` adds the boxes of so many other worlds, those of them that
start `APART` from every robot: contacts are rare among one to three boxes. `know` is what robots know besides, one or
several of:

- nothing: all is perceived
- boxes: in place of the half-spaces that a robot has made of a moving box it gets, in every tick, that of the box's
  nearest point, with the speed at which it comes and the span of the box, whatever stands between
- boxes_kept_in_sight: the same, as far off as what comes is kept so that beams tell of it (blind_zone_points.py)
- boxes_late: the same as boxes, where they were and what they did `LATE` ago
- unseen: half-spaces are perceived, and every box of which a robot has none gets that of `boxes`
- speeds: half-spaces are perceived, and those of a box come as fast as it does, with its span
- rest: half-spaces are perceived, and where there is no box they rest
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
from pbrg_mj.perception.points.blind_zone_points import blind_zone_margin
from pbrg_mj.perception.points.estimator import PointEstimator, PointMemory
from pbrg_mj.scenario.schema import MovingBox, Scenario
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.world.plant.interface import Plant
from pbrg_mj.world.scene.footprints import Footprints, signed_distance
from pbrg_mj.world.scene.obstacles import moving_footprints

RANGE, NEAR = 1.5, 0.15  # [m] of what is known, and from a box within which the face of a half-space is the box's
STEP, INSTANT = 1e-4, 0.02  # [m], [s] of differences
LATE = 0.3  # [s]
OTHER_WORLD, APART = 100_000, 0.35  # of the seed, and [m] of a box from where robots start
KNOWN = ("nothing", "boxes", "boxes_kept_in_sight", "boxes_late", "unseen", "speeds", "rest")


@dataclass(frozen=True)
class KnownBoxes:
    """The point estimator, but what it makes of moving boxes is replaced by what `know` says."""

    points: PointEstimator
    world: Plant
    boxes: tuple[MovingBox, ...]
    know: str = "boxes"

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
        perceived, memory = self.points.step_towards(readings, time, memory, m)
        if self.know == "nothing":
            return perceived, memory
        known = HalfSpaces(*(np.array(one) for one in perceived.arrays))
        for j, q in enumerate(self.world.truth().hand_world):
            near = [box for box in self.boxes if _distance(box, q, time) < RANGE]
            owners = {int(k): self._box_of(known, j, int(k), near, q, time) for k in np.flatnonzero(known.active[j])}
            if self.know == "unseen":
                self._add(known, j, [box for box in near if box not in owners.values()], q, time)
            elif self.know == "speeds":
                self._correct_speeds(known, j, owners, q, time)
            elif self.know == "rest":
                for k in (k for k, box in owners.items() if box is None):
                    self._set_speed(known, j, k, 0.0, (0.0, 0.0))
            else:
                for k in (k for k, box in owners.items() if box is not None or known.closing[j, k] > 0.0):
                    known.active[j, k], known.binds[j, k, j], known.closing[j, k] = False, False, 0.0
                self._add(known, j, near, q, time)
        return known, memory

    def _box_of(
        self, known: HalfSpaces, j: int, k: int, near: list[MovingBox], q: np.ndarray, time: float
    ) -> MovingBox | None:
        """Return the box whose face half-space k of robot j is, None if there is none so near."""
        G, parameters = known.G[j, k], self.points.parameters
        ahead = known.h[j, k] + parameters.clearance + parameters.reaction * known.closing[j, k] - G @ q
        distances = [_distance(box, q + ahead * G, time) for box in near]
        return near[int(np.argmin(distances))] if min(distances, default=np.inf) < NEAR else None

    def _correct_speeds(
        self, known: HalfSpaces, j: int, owners: dict[int, MovingBox | None], q: np.ndarray, time: float
    ) -> None:
        for k, box in owners.items():
            if box is not None:
                _, _, closing, span = self._half_space(box, q, time)
                self._set_speed(known, j, k, closing, span)

    def _set_speed(self, known: HalfSpaces, j: int, k: int, closing: float, span: tuple[float, float]) -> None:
        """Let half-space k of robot j come at `closing` [m/s]."""
        known.h[j, k] += self.points.parameters.reaction * (known.closing[j, k] - closing)
        known.closing[j, k], known.spans[j, k] = closing, span

    def _add(self, known: HalfSpaces, j: int, boxes: list[MovingBox], q: np.ndarray, time: float) -> None:
        """Add the half-spaces of boxes, as many as there are slots: those of the nearest."""
        then = max(time - LATE, 0.0) if self.know == "boxes_late" else time
        nearest = sorted(boxes, key=lambda box: _distance(box, q, then))
        for k, box in zip(np.flatnonzero(~known.active[j]), nearest, strict=False):
            known.G[j, k], known.h[j, k], known.closing[j, k], known.spans[j, k] = self._half_space(box, q, then)
            known.active[j, k] = known.binds[j, k, j] = True
            if self.know == "boxes_kept_in_sight" and known.closing[j, k] > 0.0:
                known.h[j, k] -= blind_zone_margin(self.points.parameters)

    def _half_space(self, box: MovingBox, q: np.ndarray, time: float) -> tuple[Any, ...]:
        """Return G (2,), h [m], closing [m/s] and span (2,) [m] of a box for a hand point q (2,) [m]."""
        clearance, reaction = self.points.parameters.clearance, self.points.parameters.reaction
        now = moving_footprints([box], time)
        around = q + STEP * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
        here, right, left, up, down = signed_distance(around, now).min(axis=1)
        G = np.array([left - right, down - up])
        G /= np.linalg.norm(G)
        closing = max(_distance(box, q, max(time - INSTANT, 0.0)) - here, 0.0) / INSTANT
        span = _span(now, G, clearance) if closing > 0.0 else (0.0, 0.0)
        return G, G @ q + here - clearance - reaction * closing, closing, span


def _distance(box: MovingBox, place: np.ndarray, time: float) -> float:
    """Return how far a place (2,) [m] is from a box [m]."""
    return float(signed_distance(place[None], moving_footprints([box], time)).min())


def _span(now: Footprints, G: np.ndarray, clearance: float) -> tuple[float, float]:
    """Return from where to where a box reaches across G, and the clearance beyond that [m]."""
    half = now.half_size[0] * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    corners = now.centre[0] + half[:, :1] * now.axis[0] + half[:, 1:] * [-now.axis[0, 1], now.axis[0, 0]]
    along = corners @ np.array([-G[1], G[0]])
    return along.min() - clearance, along.max() + clearance


def with_more_boxes(scenario: Scenario, seed: int, more: int) -> Scenario:
    """Return a scenario with the boxes of `more` other worlds, those that start `APART` from every robot."""
    boxes, starts = list(scenario.world.moving_boxes), np.array(scenario.team.start)[:, :2]
    for k in range(1, more + 1):
        others = loaded("moving", seed + OTHER_WORLD * k).settings.world.moving_boxes
        boxes += [one for one in others if min(_distance(one, start, 0.0) for start in starts) > APART]
    return scenario.model_copy(update={"world": scenario.world.model_copy(update={"moving_boxes": tuple(boxes)})})


def run(job: tuple[int, int, int, str]) -> tuple[int, bool, bool]:
    """Return a world's seed, whether some robot touches a moving box and whether one passes the line of one."""
    seed, noise, more, know = job
    scenario = with_more_boxes(loaded("moving", seed).settings, seed, more)
    none = scenario.reference.model_copy(update={"solver": "none"})
    scenario = scenario.model_copy(update={"reference": none, "seed": scenario.seed + 1000 * noise})
    simulation = Simulation.build(scenario)
    points = simulation.loop.estimator
    if not isinstance(points, PointEstimator):
        raise TypeError("the recommended set-up of these worlds has points")
    estimator = KnownBoxes(points, simulation.loop.world, tuple(scenario.world.moving_boxes), know)
    simulation, touched, margin = replace(simulation, loop=replace(simulation.loop, estimator=estimator)), False, np.inf
    for _ in simulation.control_ticks():
        truth = simulation.loop.world.truth()
        touched, margin = touched or bool(truth.moving_contact.any()), min(margin, float(truth.moving_margin.min()))
    return seed, touched, margin < 0.0


def _print(name: str, rows: list[tuple[int, bool, bool]]) -> None:
    touching = [seed for seed, touches, _ in rows if touches]
    worlds = ", ".join(f"{seed} ({touching.count(seed)})" for seed in dict.fromkeys(touching)) or "none"
    past = sum(row[2] for row in rows)
    print(
        f"{name}: touches a moving box in {len(touching)}, past its line in {past} of {len(rows)}; touches in {worlds}"
    )


def main(arguments: list[str]) -> None:
    keys = dict(one.split("=", 1) for one in arguments[1:])
    worlds, seeds, known = read()["moving"], seeds_of(arguments[0]), keys.get("know", "boxes").split(",")
    if unknown := [know for know in known if know not in KNOWN]:
        raise SystemExit(f"know={unknown[0]}; allowed: {', '.join(KNOWN)}")
    margin, event = COLUMNS.index("moving_margin_m"), COLUMNS.index("touching_moving")
    if "within" in keys:
        rows = {seed: worlds[str(seed)][margin] for seed in seeds if str(seed) in worlds}
        seeds = tuple(seed for seed, least in rows.items() if least is not None and least < float(keys["within"]))
    noise = seeds_of(keys["noise"], "noise") if "noise" in keys else (0,)
    more = int(keys.get("more", 0))
    measured = [seed for seed in seeds if str(seed) in worlds]
    if measured:
        _print("measured", [(seed, worlds[str(seed)][event] > 0, worlds[str(seed)][margin] < 0.0) for seed in measured])
    with multiprocessing.get_context("spawn").Pool(int(keys.get("processes", 1))) as pool:
        for know in known:
            _print(know, sorted(pool.map(run, [(seed, k, more, know) for seed in seeds for k in noise], chunksize=1)))


if __name__ == "__main__":
    main(sys.argv[1:])
