"""Half-spaces from points beside IRIS (Drake) and safe flight corridors, from the same scans; prints tables.

python scripts/safe_regions.py 4001-4010 [--places 2] [--sensor generic] [--families clutter doorway ...]
python scripts/safe_regions.py --figure                      # writes docs/img/safe_regions.png

One robot looks three times at a world of a family from random free places. What binds then is given to all methods;
IRIS gets the true solids as well. Drake (`pip install drake`) is no requirement of this project: without it there are
no rows of IRIS. docs/points.md explains the figures.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator

from regions.figure import FILE, draw
from regions.methods import DRAKE, rows
from regions.tables import by_family, by_method
from regions.views import View, family_world, view

from pbrg_mj.api.seeds import seeds_of

FAMILIES = (
    "convex_room",
    "l_room",
    "doorway",
    "corridor",
    "boxes",
    "columns",
    "boards",
    "clutter",
    "notched",
    "combined",
)
SHOWN = (("notched", 4005), ("clutter", 4003), ("doorway", 4002), ("l_room", 4010), ("convex_room", 4001))


def views(families: list[str], seeds: list[int], places: int, sensor: str) -> Iterator[View]:
    """Yield what a robot sees at so many places of every world."""
    for name in families:
        for seed in seeds:
            for place in range(places):
                yield view(name, family_world(f"families/{name}", seed), [seed, place], sensor)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("seeds", nargs="?", default="4001-4010", help="of the worlds, for example 4001-4010")
    options.add_argument("--places", type=int, default=2, help="in every world")
    options.add_argument("--sensor", default="generic", help="a preset of sensors.beams")
    options.add_argument("--families", nargs="+", default=FAMILIES, metavar="NAME")
    options.add_argument("--figure", action="store_true", help=f"write {FILE.name} and nothing else")
    given = options.parse_args()
    if not DRAKE:
        print("no rows of IRIS: Drake is missing (pip install drake)", file=sys.stderr)
    if given.figure:
        draw([view(name, family_world(f"families/{name}", seed), [seed, 0], given.sensor) for name, seed in SHOWN])
        return
    found = []
    for one in views(given.families, list(seeds_of(given.seeds)), given.places, given.sensor):
        found.append((one.name, rows(one)))
        print(f"\r{len(found)} views", end="", file=sys.stderr, flush=True)
    print(f"\n{len(found)} views, {given.sensor}\n\n{by_method(found)}\n\n{by_family(found)}")


if __name__ == "__main__":
    main()
