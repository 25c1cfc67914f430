"""Tables of measured worlds: a row a family for the newest version, and a row a version."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from worlds.data import COLUMNS, EVENTS, read

from pbrg_mj.analysis.metrics.rates import Rate
from pbrg_mj.scenario.load import load_scenario

TO_PASS = ("boards", "boxes", "clutter", "columns", "doorway", "notched")  # families whose ways lead past things
UNSEEN = "families/glass"  # no part of the sums: no beam sees it
SINGLE = ("boards", "boxes", "columns")  # families of few things in the open
LAST_OF_8_S = "a2ff331"  # until this version worlds that were not passed did not run on for 25 s
SIZES = (0.0, 0.4, 0.6, 0.8, 1.0, np.inf)  # [m]
World = dict[str, Any]
STANDING = {"touches it": "touching", "past its line": "past_a_wall", "robots touch": "touching_robots"}
WAYS = {"doorways passed": ("doorway",), "boxes, boards, columns passed": SINGLE}
MOVING = {
    "touches one": "touching_moving",
    "avoidably": "touching_moving_avoidably",
    "past its line": "past_a_moving_box",
    "past the line of what stands": "past_a_wall",
}
PASSED = {"passed after 8 s": "past_after_8_s", "passed": "past", "by sliding": "past_sliding"}


def tables(set_ups: dict[str, dict[str, Any]]) -> str:
    """Return the tables of each set-up and sensor."""
    data, versions = read()
    groups: dict[tuple[str, str], dict[str, list[World]]] = {}
    for key, rows in sorted(data.items()):
        set_up, name, *sensor = key.split(" ")
        worlds = [dict(zip(COLUMNS, row, strict=True)) for row in rows.values()]
        groups.setdefault((set_up, "".join(sensor)), {})[name] = worlds
    found = []
    for set_up, sensor in sorted(groups, key=lambda group: (list(set_ups).index(group[0]), group[1])):
        families = groups[set_up, sensor]
        settings = set_ups[set_up] | ({"sensors.beams.preset": sensor} if sensor else {})
        heading = ", ".join(f"`{key}={value}`" for key, value in settings.items())
        run = {world["version"] for worlds in families.values() for world in worlds}
        newest = [one for one in versions if one in run][-1]
        found += [table(f"{heading}, version {newest}", families, newest)]
    return "\n".join(found)


def table_by_version(set_up: str) -> str:
    """Return a row a version of what became of the worlds of a set-up, the newest first, and one of all together."""
    data, versions = read()
    worlds = [
        dict(zip(COLUMNS, row, strict=True)) | {"family": key.split(" ")[1]}
        for key, rows in data.items()
        if key.startswith(f"{set_up} ") and UNSEEN not in key.split(" ")
        for row in rows.values()
    ]
    heads = ["version", "worlds where all stands still", *STANDING, "least margin [m]", *WAYS]
    heads += ["worlds with moving boxes", *MOVING]
    lines = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    of_version = {version: [world for world in worlds if world["version"] == version] for version in versions}
    lines += [row_of_version(version, some) for version, some in reversed(of_version.items()) if some]
    return "\n".join([*lines, row_of_version("**all**", worlds)]) + "\n"


def row_of_version(name: str, worlds: list[World]) -> str:
    standing = [world for world in worlds if world["moving_margin_m"] is None]
    moving = [world for world in worlds if world["moving_margin_m"] is not None]
    cells = [name, str(len(standing)), *(total([world[flag] for world in standing]) for flag in STANDING.values())]
    cells += [least_margin(standing)]
    met = [one for one in standing if one["met"]]
    cells += [passed([one for one in met if one["family"].split("/")[1] in names], "past") for names in WAYS.values()]
    cells += [str(len(moving)), *(total([world[flag] for world in moving]) for flag in MOVING.values())]
    return f"| {' | '.join(cells)} |"


def least_margin(worlds: list[World]) -> str:
    margins = [world["wall_margin_m"] for world in worlds if world["wall_margin_m"] is not None]
    return f"{min(margins):.3f}" if margins else "-"


def table_by_size() -> str:
    """Return in how many worlds of few things all robots got past them within 25 s, by the size of the largest."""
    data, versions = read()
    whole = versions[versions.index(LAST_OF_8_S) + 1 :]
    met = [
        (name, largest(name, int(seed)), world)
        for name in SINGLE
        for seed, row in data[f"recommended families/{name}"].items()
        if (world := dict(zip(COLUMNS, row, strict=True)))["met"] and world["version"] in whole
    ]
    lines = ["| largest thing [m] | " + " | ".join(f"`families/{name}`" for name in SINGLE) + " | together |"]
    lines += ["|" + "---|" * (len(SINGLE) + 2)]
    for low, high in pairwise(SIZES):
        lines += [row_of_size(f"{low:g} to {high:g}", [one for one in met if low < one[1] <= high])]
    lines += [row_of_size("**up to 0.6**", [one for one in met if one[1] <= 0.6]), row_of_size("**all**", met)]
    newest = max((one[2]["version"] for one in met), key=whole.index)  # that drew the sensor, too
    latest = [one for one in met if one[2]["version"] == newest]
    lines += [row_of_size(f"**up to 0.6**, {newest}", [one for one in latest if one[1] <= 0.6])]
    lines += [row_of_size(f"**all**, {newest}", latest)]
    return "\n".join(lines) + "\n"


def row_of_size(head: str, met: list[tuple[str, float, World]]) -> str:
    cells = [head.replace(" to inf", " and more")]
    cells += [passed([world for name, _, world in met if name == family], "past") for family in SINGLE]
    return f"| {' | '.join(cells)} | {passed([world for *_, world in met], 'past')} |"


def largest(family: str, seed: int) -> float:
    """Return the longest side or diameter of what stands in a world [m]."""
    world = load_scenario(f"families/{family}", [f"seed={seed}"]).scenario.world
    return max([2.0 * column.radius for column in world.columns] + [max(box.size) for box in world.boxes])


def table(heading: str, families: dict[str, list[World]], version: str) -> str:
    heads = ["family", "worlds", "violated [95 %]", *EVENTS, "least margin [m]", *PASSED, "distance to go [m]"]
    lines = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    chosen = {name: [one for one in worlds if one["version"] == version] for name, worlds in families.items()}
    lines += [row(f"`{name}`", worlds, name.split("/")[1] in TO_PASS) for name, worlds in chosen.items() if worlds]
    everything = [world for name, worlds in chosen.items() if name != UNSEEN for world in worlds]
    for what, moving in (("all that stands still but glass", False), ("all with moving boxes", True)):
        some = [world for world in everything if (world["moving_margin_m"] is not None) == moving]
        lines += [row(f"**{what}**", some, False)] if some else []
    return f"{heading}:\n\n" + "\n".join(lines) + "\n"


def row(name: str, worlds: list[World], to_pass: bool) -> str:
    cells = [name, str(len(worlds)), rate(sum(world["violated"] for world in worlds), len(worlds))]
    cells += [total([world[flag] for world in worlds]) for flag in EVENTS.values()]
    cells += [least_margin(worlds)]
    met = [world for world in worlds if world["met"]] if to_pass else []
    cells += [passed(met, column) for column in PASSED.values()]
    cells += [f"{np.median([world['final_distance_m'] for world in worlds]):.2f}"]
    return f"| {' | '.join(cells)} |"


def passed(worlds: list[World], column: str) -> str:
    """Return in how many worlds all robots whose way meets something are beyond it; - where it was not looked at."""
    known = [world for world in worlds if world[column] is not None]
    if not known:
        return "-"
    past = sum(world[column] == world["met"] for world in known)
    return f"{past} of {len(known)}: {rate(past, len(known))}"


def total(counts: list[int | None]) -> str:
    """Return the sum, or nothing where earlier versions did not count."""
    return "-" if None in counts else str(sum(filter(None, counts)))


def rate(count: int, trials: int) -> str:
    found = Rate.of(count, trials)
    share, low, high = (f"{round(100 * one, 1):g}" for one in (found.share, found.low, found.high))
    return f"{share} % [{low}, {high}]"
