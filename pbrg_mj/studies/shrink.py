"""A scenario made shorter and smaller for as long as it shows the same failure."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterator
from typing import Any

from pbrg_mj.api.scenario import Scenario
from pbrg_mj.errors import InputError
from pbrg_mj.scenario.load import load_text
from pbrg_mj.scenario.parse.document import read_document, write_document
from pbrg_mj.studies.run_task import Record

OBSTACLES = ("walls", "boxes", "columns", "prisms", "moving_boxes", "patches", "thresholds", "ramps")
PER_ROBOT = (("team", "start"), ("team", "formation"), ("team", "heading_deg"))
TIME_AFTER_FAILURE = 0.1  # [s] kept after the failure
Data = dict[str, Any]


def shrunk(
    scenario: Scenario, record: Record, value: Callable[[Record], float], budget: int, run: Callable[[str, int], Record]
) -> tuple[str, Record, int]:
    """Return the YAML text of a smaller scenario that shows the failure, its record, and how many runs that took.

    `value` is below 0 for a record of the failure; `run` runs a text with a seed. Greedy: each obstacle and robot is
    left out if the failure stays without it, and the duration is cut and halved.
    """
    seed, tick = scenario.settings.seed, scenario.settings.timing.tick
    best: Data = read_document(scenario.yaml, "scenario").data
    runs = 0

    def shows(changed: Data) -> Record | None:
        nonlocal runs
        text = write_document(changed)
        try:
            load_text(text, scenario.name, file="scenario")
        except InputError:  # what is left is no scenario, such as a leader that is gone
            return None
        runs += 1
        made = run(text, seed)
        return made if made["status"] == "ok" and value(made) < 0 else None

    for smaller in (_shorter, _fewer_obstacles, _fewer_robots, _shorter):
        changed = True
        while changed and runs < budget:
            changed = False
            for candidate in smaller(best, record, tick):
                if runs >= budget:
                    break
                if (made := shows(candidate)) is not None:
                    best, record, changed = candidate, made, True
                    break
    return write_document(best | {"description": f"A failure of {scenario.name}, made shorter"}), record, runs


def _shorter(data: Data, record: Record, tick: float) -> Iterator[Data]:
    """Yield the scenario cut off after its failure, then at shares of its duration."""
    duration = record["asked_s"]
    at = record["violation_time_s"]
    ends = [at + TIME_AFTER_FAILURE] if at is not None else []
    for end in (*ends, duration / 2, 0.8 * duration):
        whole = round(math.ceil(end / tick - 1e-9) * tick, 9)
        if tick <= whole < 0.95 * duration:
            yield _with(data, ("timing", "duration"), whole)


def _fewer_obstacles(data: Data, _record: Record, _tick: float) -> Iterator[Data]:
    for kind in OBSTACLES:
        listed = data.get("world", {}).get(kind) or []
        for k in reversed(range(len(listed))):
            yield _with(data, ("world", kind), [*listed[:k], *listed[k + 1 :]])


def _fewer_robots(data: Data, _record: Record, _tick: float) -> Iterator[Data]:
    """Yield the scenario without one of its robots; numbers of those after it are one less."""
    robots = len(data["team"]["start"])
    for gone in reversed(range(robots)) if robots > 1 else ():
        changed = copy.deepcopy(data)
        for section, key in PER_ROBOT:
            if isinstance(changed[section].get(key), list):
                del changed[section][key][gone]
        leaders = [number - (number > gone + 1) for number in changed["team"]["leaders"] if number != gone + 1]
        changed["team"]["leaders"] = leaders
        for one in changed.get("estimator", {}).get("given") or ():  # what the gone robot knew, the first one knows
            one["robot"] = 1 if one["robot"] == gone + 1 else one["robot"] - (one["robot"] > gone + 1)
        yield changed


def _with(data: Data, path: tuple[str, str], value: Any) -> Data:
    changed = copy.deepcopy(data)
    changed.setdefault(path[0], {})[path[1]] = value
    return changed
