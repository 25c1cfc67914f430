"""Run worlds of families under several set-ups; write docs/data/worlds.json and the tables of docs/worlds.md.

python scripts/measure_worlds.py 2001-2060 recommended                # seeds not measured yet; 1.5 s a world
python scripts/measure_worlds.py 2001-2020 recommended families/glass # of one family alone
python scripts/measure_worlds.py 2001-2020 recommended sensor=lds_02  # another sensor than the families draw
python scripts/measure_worlds.py                                      # write the tables again

A row of the data is a world. What was measured is kept: a run that is interrupted goes on where it was.
"""

from __future__ import annotations

import json
import sys
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

import pbrg_mj as pbrg
from pbrg_mj.analysis.metrics.obstacles import footprints
from pbrg_mj.analysis.metrics.rates import Rate
from pbrg_mj.analysis.metrics.world_metrics import world_metrics
from pbrg_mj.api.seeds import seeds_of
from pbrg_mj.loop.batch import BatchHistories
from pbrg_mj.loop.one_by_one import run_world
from pbrg_mj.scenario.robots import robot_size
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.scene.footprints import Footprints, footprints_of, wall_margin

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGE, DATA = DOCS / "worlds.md", DOCS / "data" / "worlds.json"
DURATION = 8.0  # [s]
SET_UPS: dict[str, dict[str, Any]] = {  # all else default
    "distributed": {"governor.kind": "distributed"},
    "certified": {"governor.kind": "certified"},
    "recommended": {"set_up": "recommended"},
    "strict": {"set_up": "recommended", "estimator.unknown": "strict"},
}
MARK = "<!-- rates -->\n"
TO_PASS = ("boards", "boxes", "clutter", "columns", "doorway", "notched")  # families whose ways lead past things
UNSEEN = "families/glass"  # no part of the sums: no beam sees it
STEP = 0.01  # [m] between places of a way that are looked at
EVENTS = {
    "touches what stands still": "touching",
    "past its line": "past_a_wall",
    "robots touch": "touching_robots",
    "touches a moving box": "touching_moving",
    "avoidably": "touching_moving_avoidably",
    "past a moving box's line": "past_a_moving_box",
}
COLUMNS = (
    *EVENTS.values(),
    "violated",
    "robots",
    "wall_margin_m",
    "moving_margin_m",
    "final_distance_m",
    "met",
    "past",
)
Worlds = dict[str, dict[str, list[Any]]]  # of "set-up family" and what else was set, by seed; values in COLUMNS' order


def measure(seeds: tuple[int, ...], set_ups: list[str], names: list[str], sensor: str | None) -> None:
    given = {} if sensor is None else {"sensors.beams.preset": sensor}
    data = read()
    for seed, name, set_up in product(seeds, names, set_ups):
        key = " ".join([set_up, name, *given.values()])
        if str(seed) in data.get(key, {}):
            continue
        drawn = pbrg.load(name, SET_UPS[set_up] | given, duration=DURATION, seed=seed).settings
        data.setdefault(key, {})[str(seed)] = figures(name, drawn, run_world(drawn))
        write(data)
        print(key, seed, flush=True)


def figures(name: str, scenario: Scenario, histories: BatchHistories) -> list[Any]:
    """Return what became of a world, in the order of COLUMNS; None for a margin to what is not there."""
    (world,) = world_metrics(histories, scenario)
    met, past = ways(scenario, to_pass(name, scenario), histories.hand_world[0, -1])
    margins = (float(one.min()) for one in (histories.wall_margin, histories.moving_margin))
    rounded = [round(one, 5) if np.isfinite(one) else None for one in (*margins, world.final_distance_m)]
    events = [int(getattr(world, event)) for event in (*EVENTS.values(), "violated")]
    return [*events, world.robots, *rounded, met, past]


def ways(scenario: Scenario, around: Footprints, end: np.ndarray) -> tuple[int, int]:
    """Return of how many robots the straight way to their place meets `around`, and how many end beyond that.

    A way meets what stands within the clearance of it. A wall that the place itself is behind is never passed.
    """
    clearance = robot_size(scenario.robot).clearance
    start = np.array(scenario.team.start)
    place = np.array(scenario.operator.reference) + np.array(scenario.team.formation)
    met = past = 0
    for first, last, now in zip(start, place, end, strict=True):
        far = float(np.linalg.norm(last - first))
        direction, along = (last - first) / far, np.arange(0.0, far, STEP)
        blocked = along[wall_margin(first + along[:, None] * direction, around, clearance) < 0.0]
        if len(blocked):
            met += 1
            past += int((now - first) @ direction > blocked[-1])
    return met, past


def to_pass(name: str, scenario: Scenario) -> Footprints:
    """Return what stands still; of a doorway the wall without its opening, so that every way through it counts."""
    if name != "families/doorway":
        return footprints(scenario)
    walls = scenario.world.walls
    return footprints_of([walls[0].model_copy(update={"end": walls[1].end})])


def read() -> Worlds:
    return json.loads(DATA.read_text(encoding="utf-8"))["worlds"] if DATA.is_file() else {}


def write(data: Worlds) -> None:
    """Write a line a world, at once: who is interrupted leaves a whole file."""
    blocks = [
        f"{json.dumps(key)}: {{\n"
        + ",\n".join(f"{json.dumps(seed)}: {json.dumps(rows[seed])}" for seed in sorted(rows, key=int))
        + "\n}"
        for key, rows in sorted(data.items())
    ]
    text = f'{{"columns": {json.dumps(COLUMNS)},\n"worlds": {{\n' + ",\n".join(blocks) + "\n}}\n"
    part = DATA.with_suffix(".part")
    part.write_text(text, encoding="utf-8")
    part.replace(DATA)


def tables() -> str:
    """Return a table for each set-up and sensor: a row a family, and sums without and with moving boxes."""
    groups: dict[tuple[str, str], dict[str, list[dict[str, Any]]]] = {}
    for key, rows in sorted(read().items()):
        set_up, name, *sensor = key.split(" ")
        worlds = [dict(zip(COLUMNS, row, strict=True)) for row in rows.values()]
        groups.setdefault((set_up, "".join(sensor)), {})[name] = worlds
    order = sorted(groups, key=lambda group: (list(SET_UPS).index(group[0]), group[1]))
    return "\n".join(table(*group, groups[group]) for group in order)


def table(set_up: str, sensor: str, families: dict[str, list[dict[str, Any]]]) -> str:
    settings = SET_UPS[set_up] | ({"sensors.beams.preset": sensor} if sensor else {})
    heads = ["family", "worlds", "violated [95 %]", *EVENTS, "least margin [m]", "passed", "distance to go [m]"]
    lines = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    lines += [row(f"`{name}`", worlds, name.split("/")[1] in TO_PASS) for name, worlds in families.items()]
    everything = [world for name, worlds in families.items() if name != UNSEEN for world in worlds]
    for what, moving in (("all that stands still but glass", False), ("all with moving boxes", True)):
        chosen = [world for world in everything if (world["moving_margin_m"] is not None) == moving]
        lines += [row(f"**{what}**", chosen, False)] if chosen else []
    heading = ", ".join(f"`{key}={value}`" for key, value in settings.items())
    return f"{heading}:\n\n" + "\n".join(lines) + "\n"


def row(name: str, worlds: list[dict[str, Any]], to_pass: bool) -> str:
    cells = [name, str(len(worlds)), rate(sum(world["violated"] for world in worlds), len(worlds))]
    cells += [total([world[flag] for world in worlds]) for flag in EVENTS.values()]
    margins = [world["wall_margin_m"] for world in worlds if world["wall_margin_m"] is not None]
    met = [world for world in worlds if world["met"]]
    cells += [f"{min(margins):.3f}" if margins else "-"]
    past = sum(world["past"] == world["met"] for world in met)
    cells += [f"{past} of {len(met)}: {rate(past, len(met))}" if to_pass and met else "-"]
    cells += [f"{np.median([world['final_distance_m'] for world in worlds]):.2f}"]
    return f"| {' | '.join(cells)} |"


def total(counts: list[int | None]) -> str:
    """Return the sum, or nothing where earlier versions did not count."""
    return "-" if None in counts else str(sum(filter(None, counts)))


def rate(count: int, trials: int) -> str:
    found = Rate.of(count, trials)
    share, low, high = (f"{round(100 * one, 1):g}" for one in (found.share, found.low, found.high))
    return f"{share} % [{low}, {high}]"


def main(arguments: list[str]) -> None:
    if arguments:
        seeds, *others = arguments
        names = [one for one in others if one.startswith("families/")]
        sensors = [one.removeprefix("sensor=") for one in others if one.startswith("sensor=")]
        set_ups = [one for one in others if one in SET_UPS]
        every = [one.name for one in pbrg.list_scenarios() if one.family]
        measure(
            seeds_of(seeds),
            set_ups or ["distributed", "certified", "recommended"],
            names or every,
            *sensors[:1] or [None],
        )
    text = PAGE.read_text(encoding="utf-8")
    before, _, after = text.split(MARK)
    PAGE.write_text(before + MARK + "\n" + tables() + "\n" + MARK + after, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
