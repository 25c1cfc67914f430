"""Families of worlds, sweeps, tunings, searches and suites with accidents, by seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from pbrg_mj.scenario.bundled import bundled_families
from pbrg_mj.scenario.families.json_schema import family_json_schema
from pbrg_mj.scenario.schema.base import Section
from pbrg_mj.studies.bench.suite import SuiteKeys
from pbrg_mj.studies.falsify import SearchKeys
from pbrg_mj.studies.sweep_plan import SweepKeys
from pbrg_mj.studies.tune import TuneKeys
from scripts.fuzz.damage import damaged_text
from scripts.fuzz.mutants import Known, Path, changed_data, known_keys, known_of_scenarios, overrides
from scripts.fuzz.values import Rng, hostile, pick

FILE, OUTPUT = "study.yaml", "out"
LENGTH = 0.03  # of a run [s]
FAMILY_SHARE = 0.5
SEEDS = ("1", "2", "7", str(2**63 - 1), "123456789")
SWEEP = """\
scenario: [paper/simulation_near, families/columns]
seeds: 1-2
duration: 0.03
logs: true
set: {reference.solver: none}
variants: {governor: {paper: {governor.kind: distributed}, mine: {governor.kind: none}}}
grid: {control.alpha_r: [0.5, 1.5]}
random: {count: 2, seed: 4, keys: {team.heading_deg: {uniform: [0, 90]}}}
"""
TUNE = """\
scenario: paper/simulation_near
seeds: 1-2
held_out: 3
duration: 0.03
set: {governor.kind: none}
keys: {control.alpha_r: {log_uniform: [0.2, 3]}, governor.rounds: {integer: [1, 4]}}
minimize: terminal_gap_m
budget: 6
batch_size: 2
seed: 3
failure_value: 5.0
"""
SEARCH = """\
find: crossing
duration: 0.03
set: {reference.solver: none}
batch_size: 3
shrink: 5
seed: 2
keys: {operator.reference: {choice: [[0, 0.5], [3, 0]]}, governor.alpha: {uniform: [1, 7]}}
"""
SUITE = """\
description: Two governors
scenario: [families/boxes, paper/simulation_near]
train: 1
held_out: 2-3
duration: 0.03
set: {reference.period: 0.5}
governors:
  none: {settings: {governor.kind: none}, tuning: by hand}
  mine: {settings: {governor.kind: certified}, tuning: by hand}
networks: {perfect: {}, lossy: {network.loss: 0.1}}
quick: {scenario: [families/boxes], train: 1, held_out: 2, duration: 0.03, governors: [none], networks: [perfect]}
"""
STUDIES: dict[str, tuple[str, type[Section]]] = {  # by command: a file that goes with it, and its keys
    "sweep": (SWEEP, SweepKeys),
    "tune": (TUNE, TuneKeys),
    "falsify": (SEARCH, SearchKeys),
    "bench": (SUITE, SuiteKeys),
}


@dataclass(frozen=True)
class StudyMutant:
    """A file, and the commands that it is given to one after the other."""

    origin: str
    content: bytes
    commands: tuple[tuple[str, ...], ...]


def study_mutant(seed: int) -> StudyMutant:
    """Return the mutant of that number."""
    rng = np.random.default_rng((17, seed))
    if rng.random() < FAMILY_SHARE:
        name = pick(rng, list(bundled_families()))
        text, known = bundled_families()[name].read_text(), _of_families
    else:
        name = pick(rng, list(STUDIES))
        text, known = STUDIES[name][0], _of_study(name)
    content, said, kind = text.encode(), [], rng.random()
    if kind < 0.6:
        content = changed_data(rng, text, known)
    elif kind < 0.8 and name not in STUDIES:
        said = [part for one in overrides(rng, text) for part in ("--set", one)]
    else:
        for _ in range(rng.integers(1, 4)):
            content = damaged_text(rng, content)
    if name in STUDIES:
        return StudyMutant(name, content, (study_command(name, quick=bool(rng.integers(2))),))
    return StudyMutant(name, content, _commands_of_worlds(rng, said))


def study_command(name: str, *, quick: bool) -> tuple[str, ...]:
    """Return the command of a study."""
    given = {"falsify": ("families/columns", "--search", FILE, "--budget", "4")}.get(name, (FILE,))
    more = ("--quick",) * quick if name == "bench" else ("--json",)
    return (name, *given, "-o", OUTPUT, "--jobs", "1", *more)


def _commands_of_worlds(rng: Rng, said: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    seed = pick(rng, SEEDS)
    several = ("--seeds", "1-2", "--duration", str(LENGTH), "--threads", "1", "--json")
    return (
        ("draw", FILE, "--seed", seed, "-o", "world.yaml", *said),
        ("run", FILE, "--seed", seed, "-o", "world.mcap", "--duration", str(LENGTH), "--json", *said),
        *((("batch", FILE, *several, *said),) if rng.random() < 0.25 else ()),
    )


@cache
def _families() -> Known:
    return known_keys(family_json_schema())


def _of_families(rng: Rng) -> tuple[Path, Any]:
    """A key of families, of scenarios, or one that is drawn."""
    path, value = pick(rng, (_families(), known_of_scenarios))(rng)
    if rng.random() < 0.3 and path[0] != "draw":
        return ("draw", "keys", ".".join(map(str, path))), _drawn(rng, value)
    return path, value


@cache
def _of_study(command: str) -> Known:
    own = known_keys(STUDIES[command][1].model_json_schema())
    places = {"sweep": ("set", "grid", "random.keys"), "tune": ("set", "keys"), "falsify": ("set", "keys")}

    def choose(rng: Rng) -> tuple[Path, Any]:
        if rng.random() < 0.4:
            return own(rng)
        path, value = known_of_scenarios(rng)
        key, place = ".".join(map(str, path)), pick(rng, places.get(command, ("set", "networks.lossy")))
        several = {"grid": [value, value], "keys": _drawn(rng, value), "random.keys": _drawn(rng, value)}
        return (*place.split("."), key), several.get(place, value)

    return choose


def _drawn(rng: Rng, value: Any) -> Any:
    """Return a distribution in which the value is, mostly."""
    low, high = sorted(float(x) for x in rng.uniform(-3, 3, 2))
    laws = (
        {"choice": [value, hostile(rng)]},
        {"choice": [value]},
        {"uniform": [low, high]},
        {"log_uniform": [abs(low) + 0.1, abs(low) + 0.2 + abs(high)]},
        {"integer": [round(low), round(high)]},
        {"uniform": [0, 1], "per_robot": True},
        value,
    )
    return pick(rng, laws)
