"""Run worlds of all families under three set-ups; write docs/data/worlds.json and the tables of docs/worlds.md.

python scripts/measure_worlds.py 101-104               # seeds not measured yet; some 3 s of processor a world
python scripts/measure_worlds.py 101-104 certified     # under one of the set-ups
python scripts/measure_worlds.py                       # write the table again
"""

from __future__ import annotations

import json
import sys
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

import pbrg_mj as pbrg
from pbrg_mj.analysis.metrics.rates import Rate
from pbrg_mj.api.seeds import seeds_of

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGE, DATA = DOCS / "worlds.md", DOCS / "data" / "worlds.json"
DURATION = 8.0  # [s]
SET_UPS: dict[str, dict[str, Any]] = {  # all else default
    "distributed": {"governor.kind": "distributed"},
    "certified": {"governor.kind": "certified"},
    "recommended": {"set_up": "recommended"},
}
MARK = "<!-- rates -->\n"
EVENTS = {
    "touches what stands still": "world_touching",
    "past its line": "world_past_a_wall",
    "touches a moving box": "world_touching_moving",
    "robots touch": "world_touching_robots",
}
Worlds = dict[str, dict[str, dict[str, Any]]]  # of "set-up family", by seed


def measure(seeds: tuple[int, ...], set_ups: tuple[str, ...]) -> None:
    families = [one.name for one in pbrg.list_scenarios() if one.family]
    for seed, name, set_up in product(seeds, families, set_ups):
        key = f"{set_up} {name}"
        if str(seed) in read().get(key, {}):
            continue
        made = pbrg.batch(pbrg.load(name, SET_UPS[set_up], duration=DURATION), [seed])
        data = read()  # another process may have written meanwhile
        figures = {column: made[column][0].tolist() for column in made if column != "seeds"}
        data.setdefault(key, {})[str(seed)] = figures
        DATA.write_text(json.dumps(data, indent=1, sort_keys=True) + "\n", encoding="utf-8")
        print(key, seed, flush=True)


def read() -> Worlds:
    return json.loads(DATA.read_text(encoding="utf-8")) if DATA.is_file() else {}


def table() -> str:
    """Return a table for each set-up: a row a family, and one of all."""
    data, parts = read(), []
    for set_up, settings in SET_UPS.items():
        keys = [key for key in sorted(data) if key.startswith(f"{set_up} ")]
        rows = {key.split(" ")[1]: list(data[key].values()) for key in keys}
        everything = [world for worlds in rows.values() for world in worlds]
        if not everything:
            continue
        heads = ["family", "worlds", "violated [95 %]", *EVENTS, "least margin [m]", "median distance to go [m]"]
        lines = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
        lines += [row(f"`{name}`", worlds) for name, worlds in rows.items()]
        lines.append(row("**all**", everything))
        heading = ", ".join(f"`{key}={value}`" for key, value in settings.items())
        parts.append(f"{heading}:\n\n" + "\n".join(lines) + "\n")
    return "\n".join(parts)


def row(name: str, worlds: list[dict[str, Any]]) -> str:
    violated = Rate.of(sum(world["world_violated"] for world in worlds), len(worlds))
    share, low, high = (round(100 * one) for one in (violated.share, violated.low, violated.high))
    cells = [name, str(len(worlds)), f"{share} % [{low}, {high}]"]
    cells += [str(sum(world[flag] for world in worlds)) for flag in EVENTS.values()]
    margins = [world["least_margin_m"] for world in worlds]
    cells += [f"{min(margins):.3f}", f"{np.median([world['final_distance_m'] for world in worlds]):.2f}"]
    return f"| {' | '.join(cells)} |"


def main(arguments: list[str]) -> None:
    if arguments:
        measure(seeds_of(arguments[0]), tuple(arguments[1:]) or tuple(SET_UPS))
    text = PAGE.read_text(encoding="utf-8")
    before, _, after = text.split(MARK)
    PAGE.write_text(before + MARK + "\n" + table() + "\n" + MARK + after, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
