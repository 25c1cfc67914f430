"""Measure how well perception places walls; write what docs/perception-accuracy.md says of it.

python scripts/accuracy [--seeds 200] [--jobs 2] [--json]     # some four minutes; --json prints, and writes no page
"""

from __future__ import annotations

import argparse
import json
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import robots
import walls
from page import written
from scanning_robot import LOW, OTHERS, PLATES, SENSORS, scenario

PAGE = Path(__file__).resolve().parents[2] / "docs" / "perception-accuracy.md"
CHUNK = 25
ALL = (*SENSORS, *OTHERS)
LOW_RANGE = 1.0  # [m] of the walls for low beams


def measure(sensor: str, seeds: int, pool: ProcessPoolExecutor) -> dict:
    """Return all figures of a sensor."""
    limit = scenario(sensor).sensors.beams.range_max
    cells, outside = {}, []
    for cell in (walls.Cell(sensor, r, i) for r in walls.RANGES if r < limit for i in walls.INCIDENCES):
        rows = np.array(list(pool.map(partial(walls.place, cell), range(seeds), chunksize=CHUNK)))
        cells[str(cell)] = walls.figures(rows)
        evaluated = rows[:, :, walls.OUTSIDE]
        outside += evaluated[np.isfinite(evaluated)].tolist()
    return {
        "cells": cells,
        "consistency": {name: walls.pooled(cells, name) for name in ("single", "fused")},
        "outside": float(np.mean(outside)),
        "evaluated": len(outside),
        "false_walls": sum(pool.map(partial(robots.false_walls, sensor), range(seeds), chunksize=CHUNK)),
        "false_scans": seeds * robots.SCANS,
        "rows": [rows_bound(sensor, 5, spacing, seeds, pool) for spacing in robots.SPACINGS],
        "low": low_beams(sensor, seeds, pool),
    }


def low_beams(sensor: str, seeds: int, pool: ProcessPoolExecutor) -> dict:
    """Return what the same sensor does at the wheels' height: walls 1 m away, false walls, close rows."""
    cells = [walls.Cell(sensor, LOW_RANGE, i, height=LOW) for i in walls.INCIDENCES]
    rows = [np.array(list(pool.map(partial(walls.place, cell), range(seeds), chunksize=CHUNK))) for cell in cells]
    evaluated = np.concatenate([r[:, :, walls.OUTSIDE].ravel() for r in rows])
    evaluated = evaluated[np.isfinite(evaluated)]
    single, fused = (walls.pooled(dict(enumerate(map(walls.figures, rows))), name) for name in ("single", "fused"))
    false = pool.map(partial(robots.false_walls, sensor, height=LOW), range(seeds), chunksize=CHUNK)
    return {
        "recall": [walls.figures(r)["recall"] for r in rows],
        "consistency": {"single": single, "fused": fused},
        "outside": float(evaluated.mean()) if len(evaluated) else float("nan"),
        "evaluated": len(evaluated),
        "false_walls": sum(false),
        "rows": rows_bound(sensor, 5, robots.SPACINGS[0], seeds, pool, LOW),
    }


def rows_bound(
    sensor: str,
    min_points: int,
    spacing: tuple[float, float],
    seeds: int,
    pool: ProcessPoolExecutor,
    height: float = PLATES,
) -> int:
    """Return how many of `seeds` rows of robots are taken for walls."""
    binds = partial(robots.row_binds, sensor, min_points, spacing, height=height)
    return sum(pool.map(binds, range(seeds), chunksize=CHUNK))


def fewer_points(seeds: int, pool: ProcessPoolExecutor) -> dict:
    """Return what lines of four points would do to the ring: the recall at 2 m, and the rows taken for walls."""
    cells = [walls.Cell("tof_ring", 2.0, i, min_points=4) for i in walls.INCIDENCES]
    rows = [np.array(list(pool.map(partial(walls.place, cell), range(seeds), chunksize=CHUNK))) for cell in cells]
    recall = [walls.figures(r)["recall"] for r in rows]
    return {"recall": recall, "rows": [rows_bound("tof_ring", 4, s, seeds, pool) for s in robots.SPACINGS]}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--sensors", nargs="+", choices=ALL, help="only these; prints JSON, writes no page")
    args = parser.parse_args()
    with ProcessPoolExecutor(args.jobs) as pool:
        found: dict = {"seeds": args.seeds}
        found["sensors"] = {sensor: measure(sensor, args.seeds, pool) for sensor in args.sensors or ALL}
        if not args.sensors:
            found["tof_ring_of_four_points"] = fewer_points(args.seeds, pool)
    if args.json or args.sensors:
        print(json.dumps(found, indent=1))
    else:
        PAGE.write_text(written(PAGE.read_text(encoding="utf-8"), found), encoding="utf-8")


if __name__ == "__main__":
    main()
