"""Run worlds of another generator than the program's families; write docs/data/other_worlds.json and its table.

python scripts/measure_other_worlds.py static 1-500               # under the recommended set-up
python scripts/measure_other_worlds.py moving 1-500 processes=2
python scripts/measure_other_worlds.py                            # write the table of docs/worlds.md again
python scripts/measure_other_worlds.py static 7 show              # print a world as YAML

What was measured is kept, whatever its version: a measurement that is interrupted goes on where it was.
"""

from __future__ import annotations

import json
import multiprocessing
import sys
from itertools import pairwise
from typing import Any

import numpy as np
from other_worlds.conditions import CONDITIONS, condition_of
from other_worlds.draw import KINDS, scenario
from worlds.data import EVENTS, ROOT, Worlds, version, write_between, write_worlds
from worlds.tables import rate

import pbrg_mj as pbrg
from pbrg_mj.analysis.metrics.world_metrics import world_metrics
from pbrg_mj.api.seeds import seeds_of
from pbrg_mj.governor.registry import velocity_filters
from pbrg_mj.governor.velocity_filter.separation import SeparationFilter
from pbrg_mj.loop.sequential import run_world
from pbrg_mj.scenario.schema import Scenario

DATA = ROOT / "docs" / "data" / "other_worlds.json"
MARK = "<!-- other worlds -->\n"
COLUMNS = ("version", "sensor", "robots", "boxes", "speed_ratio", *EVENTS.values(), "wall_margin_m", "moving_margin_m")
CONTACTS = "touching", "touching_robots", "touching_moving"
FAMILY_SENSORS = ("generic", "robotarium", "tof_ring", "lidar")  # that the families with moving boxes draw
GROUPS = {
    "what stands, generic robots": ("static", lambda world: True),
    "what stands, five other robots, 16 s": ("robots", lambda world: True),
    "indoors, any robots, sent to and fro for 25 s": ("indoor", lambda world: True),
    "indoors likewise, each with one more condition": ("conditions", lambda world: True),
    "one moving box": ("moving", lambda world: world["boxes"] == 1),
    "two or three moving boxes": ("moving", lambda world: world["boxes"] > 1),
    "all with moving boxes": ("moving", lambda world: True),
    "of these, boxes at most half as fast as robots may drive": ("moving", lambda world: world["speed_ratio"] <= 0.5),
    "of these, faster boxes": ("moving", lambda world: world["speed_ratio"] > 0.5),
    "of these, sensors of `families/moving_boxes`": ("moving", lambda world: world["sensor"] in FAMILY_SENSORS),
    "moving boxes, five other robots, 24 s": ("moving_robots", lambda world: True),
    "of these, boxes at most half as fast as they may drive": (
        "moving_robots",
        lambda world: world["speed_ratio"] <= 0.5,
    ),
}
BY_SENSOR = {  # kind and event
    ("static", "touching"): "all stands still: touches it",
    ("static", "past_a_wall"): "past its line",
    ("moving", "touching_moving"): "boxes move: touches one",
    ("moving", "past_a_moving_box"): "past a moving box's line",
}


def loaded(kind: str, seed: int) -> pbrg.Scenario:
    return pbrg.load(scenario(kind, seed), {"set_up": "recommended"})


def speed_ratio(settings: Scenario) -> float:
    """Return how fast the fastest moving box of a run is, by how fast robots may drive in the best direction.

    That is what wheels can do, or what the lags of camera and radio leave to steer. Raises ValueError where boxes move
    and robots keep no distance: the filter that does knows it.
    """
    fastest = 0.0
    for box in settings.world.moving_boxes:
        for one, after in pairwise(box.waypoints):
            if one.time < settings.timing.duration:
                way = np.subtract(after.center, one.center)
                fastest = max(fastest, float(np.linalg.norm(way)) / (after.time - one.time))
    if fastest == 0.0:
        return 0.0
    keeper = next((one for one in velocity_filters(settings) if isinstance(one, SeparationFilter)), None)
    if keeper is None:
        raise ValueError("boxes move, and there is no control.separation")
    angle = np.linspace(0.0, 2.0 * np.pi, 720)
    inverse = (keeper.facets @ [np.cos(angle), np.sin(angle)]).max(axis=0)
    return fastest * float(inverse.min())


def run(job: tuple[str, int]) -> tuple[str, int, list[Any]]:
    """Return a world's row but for the version."""
    kind, seed = job
    return kind, seed, measured(loaded(kind, seed).settings)


def measured(settings: Scenario) -> list[Any]:
    """Run a world and return `COLUMNS` of it but for the version."""
    ratio = round(speed_ratio(settings), 3)
    histories = run_world(settings)
    (world,) = world_metrics(histories, settings)
    margins = (float(one.min()) for one in (histories.wall_margin, histories.moving_margin))
    rounded = [round(one, 5) if np.isfinite(one) else None for one in margins]
    events = [int(getattr(world, event)) for event in EVENTS.values()]
    boxes = len(settings.world.moving_boxes)
    what = settings.sensors.beams.preset, world.robots, boxes, ratio
    return [*what, *events, *rounded]


def read() -> Worlds:
    return json.loads(DATA.read_text(encoding="utf-8"))["worlds"] if DATA.is_file() else {}


def measure(kind: str, seeds: list[int], processes: int) -> None:
    data, now = read(), version()
    todo = [(kind, seed) for seed in seeds if str(seed) not in data.get(kind, {})]
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        for count, (_, seed, row) in enumerate(pool.imap_unordered(run, todo), 1):
            data.setdefault(kind, {})[str(seed)] = [now, *row]
            if count % 25 == 0 or count == len(todo):
                write_worlds(DATA, {"columns": COLUMNS}, data)
                print(kind, count, flush=True)


def table() -> str:
    heads = ["worlds of another generator", "worlds", "touches anything [95 %]", *EVENTS, "least margins [m]"]
    lines, data = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)], read()
    for name, (kind, belongs) in GROUPS.items():
        if chosen := [world for world in worlds_of(data, kind) if belongs(world)]:
            lines.append(row_of(name, chosen))
    versions = [f"{kind} of version {', '.join(sorted({row[0] for row in data[kind].values()}))}" for kind in data]
    lines += ["", *by_sensor(data), "", *by_condition(data), "", f"*`set_up=recommended`; {'; '.join(versions)}.*"]
    return "\n".join(lines) + "\n"


def worlds_of(data: Worlds, kind: str) -> list[dict[str, Any]]:
    return [as_world(int(seed), row) for seed, row in data.get(kind, {}).items()]


def as_world(seed: int, row: list[Any]) -> dict[str, Any]:
    return {"seed": seed, **dict(zip(COLUMNS, row, strict=True))}


def by_sensor(data: Worlds) -> list[str]:
    """Return the lines of a table of what becomes of worlds with each sensor."""
    worlds = {kind: worlds_of(data, kind) for kind, _ in BY_SENSOR}
    sensors = sorted({world["sensor"] for of_kind in worlds.values() for world in of_kind})
    lines = [f"| worlds of another generator | {' | '.join(f'`{one}`' for one in sensors)} |"]
    lines.append("|" + "---|" * (len(sensors) + 1))
    for (kind, event), head in BY_SENSOR.items():
        of_sensor = [[world[event] for world in worlds[kind] if world["sensor"] == one] for one in sensors]
        cells = [f"{sum(one)} of {len(one)}: {rate(sum(one), len(one))}" if one else "-" for one in of_sensor]
        lines.append(f"| {head} | {' | '.join(cells)} |")
    return lines


def by_condition(data: Worlds) -> list[str]:
    """Return the lines of a table of what becomes of worlds with each condition."""
    worlds = worlds_of(data, "conditions")
    lines = ["| indoors, with | worlds | touches anything | past a line | least margin [m] |", "|---|---|---|---|---|"]
    for name in CONDITIONS:
        chosen = [world for world in worlds if condition_of(world["seed"]) == name]
        touching, past = (sum(any(one[key] for key in keys) for one in chosen) for keys in (CONTACTS, ["past_a_wall"]))
        least = min((one["wall_margin_m"] for one in chosen if one["wall_margin_m"] is not None), default=np.nan)
        lines.append(f"| {name} | {len(chosen)} | {touching} | {past} | {least:.3f} |")
    return lines


def row_of(name: str, worlds: list[dict[str, Any]]) -> str:
    counts = [str(sum(world[event] for world in worlds)) for event in EVENTS.values()]
    touching = sum(any(world[event] for event in CONTACTS) for world in worlds)
    margins = [[world[key] for world in worlds if world[key] is not None] for key in COLUMNS[-2:]]
    least = ", ".join(f"{min(one):.3f}" if one else "-" for one in margins)
    return f"| {name} | {len(worlds)} | {rate(touching, len(worlds))} | {' | '.join(counts)} | {least} |"


def main(arguments: list[str]) -> None:
    if arguments:
        kind, seeds, *others = arguments
        if kind not in KINDS:
            raise SystemExit(f"unknown: {kind}; allowed: {', '.join(KINDS)}")
        if "show" in others:
            print(loaded(kind, int(seeds)).yaml)
            return
        keys = dict(one.split("=", 1) for one in others)
        measure(kind, list(seeds_of(seeds)), int(keys.get("processes", 1)))
    write_between(MARK, table())


if __name__ == "__main__":
    main(sys.argv[1:])
