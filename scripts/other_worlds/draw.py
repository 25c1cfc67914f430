"""A world of a seed as a scenario, drawn without the program's families.

- `static`: a generic robot's team among one to three of the shapes of `solids`
- `moving`: none to two of these, and one to three boxes at 3 to 29 cm/s that rest in between, and touch nothing else
- `robots`: as `static`, with one of the other five robots
- `moving_robots`: as `moving`, with one of the other five robots, and boxes at 4 to 40 % of what its wheels can do
- `indoor`: a team, in two of five worlds of one of the other robots, among one to three shapes of `indoor`, which
  begin 1 cm beyond the clearance; it is sent to and fro for 25 s
- `conditions`: as `indoor`, with one of `conditions`, by turns

Two to six robots from anywhere around the origin at any heading, in any formation, with every bundled sensor. In two of
five worlds the reference changes on the way, up to three times, indoors in all. Drives, floors, radio and camera vary.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from other_worlds.conditions import CONDITIONS, ON_WHEELS, Drawn, condition_of
from other_worlds.geometry import nearer_than, rectangle, signed_distance
from other_worlds.indoor import INDOOR
from other_worlds.solids import SHAPES, Solids, number, numbers

KINDS = ("static", "moving", "robots", "indoor", "conditions", "moving_robots")
MOVING = ("moving", "moving_robots")
OTHER_ROBOTS = ("robots", "moving_robots")
INDOORS = ("indoor", "conditions")
SENSORS = ("generic", "robotarium", "tof_ring", "tof_cones", "lidar", "lds_02")
ROBOTS = {"khepera4": (1.1, 0.12), "omni": (1.0, 0.06), "turtlebot3_burger": (1.9, 0.215), "epuck2": (0.7, 0.062)}
ROBOTS |= {"gritsbot": (1.0, 0.105)}  # by what places are scaled, and the clearance [m]
GENERIC = 1.0, 0.1
WHEELS = {"khepera4": 1.0, "omni": 0.96, "turtlebot3_burger": 0.21, "epuck2": 0.15, "gritsbot": 0.2}  # [m/s] at most
BOXES = {"generic": (0.03, 0.29)} | {name: (0.04 * most, 0.4 * most) for name, most in WHEELS.items()}  # [m/s]
UNTIL = {"static": 8.0, "moving": 8.0, "robots": 16.0, "indoor": 25.0, "conditions": 25.0, "moving_robots": 24.0}  # [s]


def scenario(kind: str, seed: int, robots: int | None = None) -> dict[str, Any]:
    """Return a world; whatever is drawn is drawn again until the team's start is free.

    With `robots` the team has so many in place of two to six, and where it has more than four as much room for each.
    """
    rng = np.random.default_rng([KINDS.index(kind), seed])
    others = kind in OTHER_ROBOTS or (kind in INDOORS and rng.random() < 0.4)
    add = CONDITIONS[condition_of(seed)] if kind == "conditions" else None
    models = [one for one in ROBOTS if one != "omni" or add not in ON_WHEELS]
    robot = str(rng.choice(models)) if others else "generic"
    while (found := _drawn(kind, rng, robot, robots)) is None:
        pass
    if add is not None:
        add(Drawn(rng, found))
        found["description"] = f"{condition_of(seed)}: {found['description']}"
    return found


def _drawn(kind: str, rng: np.random.Generator, robot: str, robots: int | None) -> dict[str, Any] | None:
    scale, clearance = ROBOTS.get(robot, GENERIC)
    count = int(rng.integers(2, 7))
    room = 1.0
    if robots is not None:
        count, room = robots, max(1.0, math.sqrt(robots / 4))
    start = _apart(rng, count, room * scale * rng.uniform(0.45, 0.9), 2 * clearance + 0.05 * scale)
    formation = _apart(rng, count, room * scale * rng.uniform(0.3, 0.7), 2 * clearance + 0.03)
    heading, direction = rng.uniform(-np.pi, np.pi, count), rng.uniform(0, 2 * np.pi)
    if start is None or formation is None:
        return None
    solids = Solids(rng, scale, direction)
    fewest, most = (0, 2) if kind in MOVING else (1, 3)
    known = INDOOR if kind in INDOORS else SHAPES
    shapes = rng.choice(list(known), int(rng.integers(fewest, most + 1)), replace=False)
    for shape in shapes:
        known[str(shape)](solids)
    beyond = scale * (float(rng.choice([0.01, 0.06, 0.15])) if kind in INDOORS else 0.06)
    body = start - 0.04 * scale * np.column_stack([np.cos(heading), np.sin(heading)])
    places = np.concatenate([start, body])
    if any(signed_distance(places, polygon).min() < clearance + beyond for polygon in solids.polygons):
        return None
    boxes = _moving_boxes(solids, places, BOXES[robot], 2 * clearance, UNTIL[kind]) if kind in MOVING else []
    if boxes is None:
        return None
    sensor = str(rng.choice(SENSORS))
    world = {name: section for name, section in {**solids.sections, "moving_boxes": boxes}.items() if section}
    leaders = rng.choice(count, min(int(rng.integers(1, 3)), count), replace=False) + 1
    return {
        "description": " ".join(["moving boxes"] * bool(boxes) + list(map(str, shapes))),
        "timing": {"duration": UNTIL[kind]},
        "robot": robot,
        "seed": int(rng.integers(1, 10**6)),
        "team": {
            "leaders": sorted(leaders.tolist()),
            "start": [numbers(one) for one in start],
            "formation": [numbers(one) for one in formation],
            "heading_deg": numbers(np.degrees(heading)),
        },
        "graph": {"kind": str(rng.choice(["ring", "path", "complete"] if count > 2 else ["path", "complete"]))},
        "operator": _tour(solids, UNTIL[kind]) if kind in INDOORS else _operator(solids),
        "governor": {"initial": "start"},
        **_hardware(rng, robot, sensor, world),
    }


def _apart(rng: np.random.Generator, count: int, reach: float, apart: float) -> np.ndarray | None:
    """Return places (count, 2) in a square that are so far apart [m]; None where there are not enough."""
    found: list[np.ndarray] = []
    for _ in range(2000):
        place = rng.uniform(-reach, reach, 2)
        if all(np.linalg.norm(place - other) > apart for other in found):
            found.append(place)
        if len(found) == count:
            return np.array(found)
    return None


def _operator(solids: Solids) -> dict[str, Any]:
    rng, first = solids.rng, numbers(solids.at(solids.uniform(1.2, 3.0), 0.0))
    if rng.random() < 0.6:
        return {"reference": first}
    waypoints, time = [{"time": 0.0, "reference": first}], 0.0
    for _ in range(int(rng.integers(1, 4))):
        time = round(time + solids.uniform(1.0, 4.0), 2)
        waypoints.append({"time": time, "reference": numbers(solids.scale * rng.uniform(-2, 2, 2))})
    return {"waypoints": waypoints}


def _tour(solids: Solids, until: float) -> dict[str, Any]:
    waypoints, time = [], 0.0
    while time < until:
        reference = numbers(solids.scale * solids.rng.uniform(-2.6, 2.6, 2))
        waypoints.append({"time": round(time, 2), "reference": reference})
        time += solids.uniform(2.0, 9.0)
    return {"waypoints": waypoints}


def _hardware(rng: np.random.Generator, robot: str, sensor: str, world: dict[str, Any]) -> dict[str, Any]:
    drive: dict[str, Any] = {"pwm_levels": 255} if rng.random() < 0.3 else {}
    sensors: dict[str, Any] = {"beams": {"preset": sensor}}
    given: dict[str, Any] = {"drive": drive, "sensors": sensors, "world": world}
    if robot != "omni":
        drive |= {"kind": "speed_loop"} if rng.random() < 0.3 else {}
        drive |= {"friction": number(rng.uniform(0.8, 1.2))} if rng.random() < 0.3 else {}
        world |= {"floor_friction": number(rng.uniform(0.6, 1.0))} if rng.random() < 0.3 else {}
    if rng.random() < 0.25:
        given["radio"] = {"delay": number(rng.uniform(0, 0.03)), "jitter": number(rng.uniform(0, 0.01))}
    if rng.random() < 0.25:
        sensors["camera"] = {"delay": number(rng.uniform(0, 0.05)), "lost_frames": number(rng.uniform(0, 0.1))}
    return given


def _moving_boxes(
    solids: Solids, places: np.ndarray, speeds: tuple[float, float], free: float, until: float
) -> list[dict[str, Any]] | None:
    """Return one to three boxes at `speeds` [m/s].

    None if one is nearer than `free` [m] to `places` (k, 2) at the start, or meets what stands or another one within
    `until` [s].
    """
    rng, boxes = solids.rng, []
    for _ in range(int(rng.integers(1, 4))):
        center, time = solids.at(solids.uniform(-1.5, 3.0), rng.choice([-1, 1]) * solids.uniform(0.4, 2.0)), 0.0
        waypoints = [{"time": 0.0, "center": numbers(center)}]
        if rng.random() < 0.4:
            time += solids.uniform(0.3, 3.0)
            waypoints.append({"time": round(time, 3), "center": numbers(center)})
        for _ in range(int(rng.integers(1, 5))):
            near_way = solids.at(solids.uniform(-0.5, 2.5), solids.uniform(-1.0, 1.0))
            goal = near_way if rng.random() < 0.7 else center + solids.scale * rng.uniform(-1, 1, 2)
            if np.linalg.norm(goal - center) < 0.1 * solids.scale:
                continue
            time += float(np.linalg.norm(goal - center)) / solids.uniform(*speeds)
            center = goal
            waypoints.append({"time": round(time, 3), "center": numbers(center)})
            if rng.random() < 0.4:
                time += solids.uniform(0.2, 2.0)
                waypoints.append({"time": round(time, 3), "center": numbers(center)})
        boxes.append({"size": numbers(solids.scale * rng.uniform(0.12, 0.9, 2)), "waypoints": waypoints})
    near_start = any(signed_distance(places, _footprint(box, 0.0)).min() < free for box in boxes)
    return None if near_start or _meet(boxes, solids.polygons, until) else boxes


def _meet(boxes: list[dict[str, Any]], polygons: list[np.ndarray], until: float) -> bool:
    """Tell whether a box comes nearer than 2 cm to what stands or to another one within `until` [s]."""
    for time in np.arange(0.0, until + 0.1, 0.2):
        prints = [_footprint(box, time) for box in boxes]
        for k, one in enumerate(prints):
            if any(nearer_than(0.02, one, other) for other in [*polygons, *prints[:k]]):
                return True
    return False


def _footprint(box: dict[str, Any], time: float) -> np.ndarray:
    times, centers = [one["time"] for one in box["waypoints"]], np.array([one["center"] for one in box["waypoints"]])
    center = np.array([np.interp(time, times, centers[:, axis]) for axis in (0, 1)])
    return rectangle(center, np.array(box["size"]), 0.0)
