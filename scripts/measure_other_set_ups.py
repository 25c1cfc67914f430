"""Run worlds of `measure_other_worlds.py` with other keys, or teams of other sizes; print a row of the same table.

python scripts/measure_other_set_ups.py static 24501-24560 governor.optimizer=nids processes=2
python scripts/measure_other_set_ups.py static 24201-24300 robots=1,8,10,12
python scripts/measure_other_set_ups.py static 23801-23900 "sensors.uwb.anchors=[[-5,-5],[5,-5],[5,5],[-5,5]]"

Keys come on top of the recommended set-up. Of several sizes, worlds have one after the other. Every world with a
contact, or in which a line is passed, has a line of its own on stderr.
"""

from __future__ import annotations

import multiprocessing
import sys
from typing import Any

from measure_other_worlds import CONTACTS, as_world, measured, row_of
from other_worlds.draw import KINDS, scenario
from worlds.data import EVENTS, version

import pbrg_mj as pbrg
from pbrg_mj.api.seeds import seeds_of

Job = tuple[str, int, int | None, tuple[str, ...]]  # kind, seed, robots, KEY=VALUE


def run(job: Job) -> tuple[int, list[Any]]:
    kind, seed, robots, overrides = job
    loaded = pbrg.load(scenario(kind, seed, robots)).override(["set_up=recommended", *overrides])
    return seed, measured(loaded.settings)


def main(arguments: list[str]) -> None:
    if len(arguments) < 2 or arguments[0] not in KINDS:
        raise SystemExit(f"KIND SEEDS [robots=N,...] [processes=N] [KEY=VALUE ...]; kinds: {', '.join(KINDS)}")
    kind, seeds, *given = arguments
    own = dict(one.split("=", 1) for one in given if one.startswith(("robots=", "processes=")))
    overrides = tuple(one for one in given if one.split("=", 1)[0] not in own)
    sizes = [int(one) for one in own["robots"].split(",")] if "robots" in own else [None]
    jobs = [(kind, seed, sizes[k % len(sizes)], overrides) for k, seed in enumerate(seeds_of(seeds))]
    with multiprocessing.get_context("spawn").Pool(int(own.get("processes", 1))) as pool:
        found = list(pool.imap_unordered(run, jobs))
    now = version()
    worlds = [as_world(seed, [now, *row]) for seed, row in found]
    for world in worlds:
        if happened := [key for key in (*CONTACTS, *EVENTS.values()) if world[key]]:
            print(world["seed"], world["sensor"], *dict.fromkeys(happened), file=sys.stderr)
    print(row_of(" ".join([kind, seeds, *given]), worlds))


if __name__ == "__main__":
    main(sys.argv[1:])
