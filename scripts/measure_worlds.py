"""Run worlds of families under several set-ups; write docs/data/worlds.json and what docs/worlds*.md tell of it.

python scripts/measure_worlds.py 2001-2060 recommended                # seeds not measured yet, one after the other
python scripts/measure_worlds.py 2001-2060 recommended processes=2    # two worlds at a time
python scripts/measure_worlds.py 2001-2020 recommended families/glass # of one family alone
python scripts/measure_worlds.py 2001-2020 recommended sensor=lds_02  # another sensor than the families draw
python scripts/measure_worlds.py 2001-2020 recommended until=20       # 20 s in place of 25 s
python scripts/measure_worlds.py                                      # write the tables again

A world is run for 8 s. Where its ways lead past something that not all robots have passed by then, it is run again for
25 s, and that run is what counts. A row of the data is a world, with the version of the code that was run. What was
measured is kept, whatever its version: a measurement that is interrupted goes on where it was.
"""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Iterator
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from worlds.data import EVENTS, HISTORY, read, version, write, write_between
from worlds.tables import TO_PASS, table_by_size, table_by_version, tables
from worlds.ways import end_of_sliding, to_pass, ways

import pbrg_mj as pbrg
from pbrg_mj.analysis.metrics.world_metrics import world_metrics
from pbrg_mj.api.seeds import seeds_of
from pbrg_mj.loop.batch_histories import BatchHistories
from pbrg_mj.loop.sequential import run_world
from pbrg_mj.scenario.schema import Scenario

DURATION, UNTIL = 8.0, 25.0  # [s] the later one where not all have passed
SET_UPS: dict[str, dict[str, Any]] = {  # all else default
    "distributed": {"governor.kind": "distributed"},
    "certified": {"governor.kind": "certified"},
    "recommended": {"set_up": "recommended"},
    "strict": {"set_up": "recommended", "estimator.unknown": "strict"},
}
MARK = "<!-- rates -->\n"
BY_SIZE = "<!-- passed by size -->\n"
BY_VERSION = "<!-- by version -->\n"


class Job(NamedTuple):
    """A world to be run."""

    set_up: str
    name: str  # of the family
    sensor: str | None
    seed: int
    until: float  # [s]

    @property
    def key(self) -> str:
        return " ".join(filter(None, (self.set_up, self.name, self.sensor)))


def measure(jobs: list[Job], processes: int) -> None:
    (data, versions), now = read(), version()
    todo = [job for job in jobs if str(job.seed) not in data.get(job.key, {})]
    versions += [now] * (now not in versions)
    for job, row in rows(todo, processes):
        data.setdefault(job.key, {})[str(job.seed)] = [*row, now]
        write(data, versions)
        print(job.key, job.seed, flush=True)


def rows(jobs: list[Job], processes: int) -> Iterator[tuple[Job, list[Any]]]:
    if processes == 1:
        yield from map(run, jobs)
        return
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        yield from pool.imap_unordered(run, jobs)


def run(job: Job) -> tuple[Job, list[Any]]:
    """Return a world's row but for the version."""
    leads_past = job.name.split("/")[1] in TO_PASS
    scenario, histories, (met, past) = simulated(job, DURATION)
    past_at_first, past_sliding = past, None
    if leads_past and past < met and job.until > DURATION:
        scenario, histories, (met, past) = simulated(job, job.until)
    if leads_past and met:
        past_sliding = ways(scenario, to_pass(job.name, scenario), end_of_sliding(scenario))[1]
    return job, [*figures(scenario, histories), met, past, past_at_first, past_sliding, scenario.timing.duration]


def simulated(job: Job, duration: float) -> tuple[Scenario, BatchHistories, tuple[int, int]]:
    """Return a world, what happened in it, and of how many robots' ways something is met and passed."""
    given = SET_UPS[job.set_up] | ({} if job.sensor is None else {"sensors.beams.preset": job.sensor})
    scenario = pbrg.load(job.name, given, duration=duration, seed=job.seed).settings
    histories = run_world(scenario)
    return scenario, histories, ways(scenario, to_pass(job.name, scenario), histories.hand_world[0, -1])


def figures(scenario: Scenario, histories: BatchHistories) -> list[Any]:
    """Return what became of a world, in the order of COLUMNS up to the ways; None for a margin to what is not there."""
    (world,) = world_metrics(histories, scenario)
    margins = (float(one.min()) for one in (histories.wall_margin, histories.moving_margin))
    rounded = [round(one, 5) if np.isfinite(one) else None for one in (*margins, world.final_distance_m)]
    events = [int(getattr(world, event)) for event in (*EVENTS.values(), "violated")]
    return [*events, world.robots, *rounded]


def jobs_of(arguments: list[str]) -> tuple[list[Job], int]:
    """Return the worlds that arguments ask for, and how many are to be run at a time."""
    seeds, *others = arguments
    keys = dict(one.split("=", 1) for one in others if "=" in one)
    every = [one.name for one in pbrg.list_scenarios() if one.family]
    names = [one for one in others if one.startswith("families/")] or every
    set_ups = [one for one in others if one in SET_UPS] or ["distributed", "certified", "recommended"]
    known = {"sensor", "until", "processes"}
    if wrong := [one for one in others if one not in {*every, *SET_UPS} and one.split("=")[0] not in known]:
        raise SystemExit(f"unknown: {', '.join(wrong)}")
    sensor, until = keys.get("sensor"), float(keys.get("until", UNTIL))
    jobs = [Job(set_up, name, sensor, seed, until) for seed, name, set_up in product(seeds_of(seeds), names, set_ups)]
    return jobs, int(keys.get("processes", 1))


def main(arguments: list[str]) -> None:
    if arguments:
        measure(*jobs_of(arguments))
    write_between(MARK, tables(SET_UPS))
    write_between(BY_SIZE, table_by_size())
    write_between(BY_VERSION, table_by_version("recommended"), HISTORY)


if __name__ == "__main__":
    main(sys.argv[1:])
