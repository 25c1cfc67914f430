"""SWEEP.yaml: which runs a sweep makes, in which order."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from pbrg_mj.api.scenario import Scenario
from pbrg_mj.api.seeds import seeds_of
from pbrg_mj.errors import InputError
from pbrg_mj.scenario.diagnostics import KeyPath
from pbrg_mj.scenario.families.distributions import random_of, value
from pbrg_mj.scenario.families.schema import Distribution
from pbrg_mj.scenario.schema.base import Section
from pbrg_mj.studies.document import StudyFile, plain
from pbrg_mj.studies.task import Source, Task

MOST_RUNS = 1_000_000
Seed = Annotated[int, Field(ge=0, lt=2**63)]
Values = dict[str, Any]


class RandomDraws(Section):
    """`random`: settings drawn anew, each for all seeds."""

    count: Annotated[int, Field(ge=1, le=MOST_RUNS)] = Field(description="how many")
    seed: Seed = Field(default=1, description="of the draws, not of the runs")
    keys: dict[str, Distribution] = Field(description="distributions by dotted keys", min_length=1)


class SweepKeys(Section):
    """A sweep: all combinations of what it lists."""

    scenario: str | tuple[str, ...] = Field(description="a file beside this one, a bundled name, or several")
    seeds: str | Seed | tuple[Seed, ...] = Field(default="1", description="such as 1-8,20, or a list")
    duration: Annotated[float, Field(gt=0)] | None = Field(default=None, description="simulated time [s]")
    set: Values = Field(default={}, description="values of keys, the same in all runs")
    variants: dict[str, dict[str, Values]] = Field(default={}, description="by axis and name: values of several keys")
    grid: dict[str, tuple[Any, ...]] = Field(default={}, description="lists of values by dotted keys")
    random: RandomDraws | None = Field(default=None, description="settings drawn at random")
    logs: bool = Field(default=False, description="keep every run's log in the folder logs/")


Entries = dict[KeyPath, Values]  # where settings stand in the file
Axis = list[tuple[dict[str, Any], Values]]  # labels, and the settings that go with them


def plan(file: StudyFile[SweepKeys]) -> list[Task]:
    """Return all runs: scenarios, then variants, grid, random draws and seeds, the last one fastest.

    Before anything runs, each value is tried with the first one of every other axis. Raises InputError.
    """
    scenarios, seeds, always = sources(file), seed_list(file), always_set(file.keys)
    axes = list(_axes(file))
    _check_once(file)
    total = len(scenarios) * len(seeds)
    for axis in axes:
        total *= len(axis)
    if total > MOST_RUNS:
        raise InputError(f"asks for {total} runs; allowed: at most {MOST_RUNS}", file=str(file.path))
    for source in scenarios:
        _try(file, source, seeds[0])
    chosen = [(_merged(label for label, _ in parts), _merged(part for _, part in parts)) for parts in product(*axes)]
    return [
        Task(source, always | settings, seed, labels)
        for source, (labels, settings), seed in product(scenarios, chosen, seeds)
    ]


def sources(file: StudyFile[Any], copies: Path | None = None) -> list[Source]:
    """Return the scenarios; of a folder with `copies` of those that are not bundled no other files.

    Raises InputError with the line that names one that is not there.
    """
    names = file.keys.scenario
    listed = (
        [(("scenario",), names)] if isinstance(names, str) else [(("scenario", k), one) for k, one in enumerate(names)]
    )
    if not listed:
        raise file.error(("scenario",), "is empty; allowed: a file, or a bundled name (see: pbrg list)")
    found = []
    for path, name in listed:
        try:
            found.append(Source.of(name, file.folder) if copies is None else _copied(name, copies))
        except InputError as error:
            raise file.error(path, error.message) from None
    return found


def _copied(name: str, copies: Path) -> Source:
    """Return the scenario as the folder has it, by the stem of its file, or the bundled one. Raises InputError."""
    copy = f"{Path(name).stem}.yaml"
    if (copies / copy).is_file():
        return Source.of(copy, copies)
    if bundled := Source.bundled(name):
        return bundled
    raise InputError(f"is not bundled; required: {copies.name}/{copy} in {copies.parent}")


def seed_list(file: StudyFile[Any], key: str = "seeds") -> tuple[int, ...]:
    """Return the seeds that a key lists. Raises InputError."""
    seeds = getattr(file.keys, key)
    if isinstance(seeds, int):
        return (seeds,)
    if isinstance(seeds, str):
        try:
            return seeds_of(seeds, "this")
        except InputError as error:
            raise file.error((key,), error.message.removeprefix("this ")) from None
    if not seeds or len(set(seeds)) < len(seeds):
        raise file.error((key,), "is empty or has a seed twice; allowed: each seed once")
    return tuple(seeds)


def always_set(keys: Any) -> Values:
    """Return what is set in all runs."""
    length = {} if keys.duration is None else {"timing.duration": keys.duration}
    return plain(keys.set) | length


def _axes(file: StudyFile[SweepKeys]) -> Iterator[Axis]:
    keys = file.keys
    for name, variants in keys.variants.items():
        if not variants:
            raise file.error(("variants", name), "is empty; allowed: at least one variant")
        yield [({f"variants.{name}": one}, plain(values)) for one, values in variants.items()]
    for key, values in keys.grid.items():
        if not values:
            raise file.error(("grid", key), "is empty; allowed: at least one value")
        yield [({f"keys.{key}": one}, {key: one}) for one in plain(values)]
    if keys.random is not None:
        yield list(_draws(keys.random))


def _check_once(file: StudyFile[SweepKeys]) -> None:
    """Raise InputError for a key that two parts of the file give values."""
    keys, first = file.keys, dict[str, str]()
    parts = {"set": (*keys.set, *(["timing.duration"] if keys.duration is not None else [])), "grid": tuple(keys.grid)}
    parts |= {"random.keys": tuple(keys.random.keys) if keys.random else ()}
    for part, names in parts.items():
        for name in names:
            if name == "seed" or name in first:
                given = "by seeds" if name == "seed" else f"in {first[name]}, too"
                raise file.error((*part.split("."), name), f"is given {given}; allowed: once")
            first[name] = part


def _draws(random: RandomDraws) -> Iterator[tuple[dict[str, Any], Values]]:
    for index in range(random.count):
        drawn = {key: plain(value(one, random_of(random.seed, key, index))) for key, one in random.keys.items()}
        yield {"draw": index, **{f"keys.{key}": one for key, one in drawn.items()}}, drawn


def _try(file: StudyFile[SweepKeys], source: Source, seed: int) -> None:
    """Try each value with the first one of every other axis. Raises InputError at the line of what is wrong."""
    keys = file.keys
    fixed: Entries = {("set", key): {key: one} for key, one in plain(keys.set).items()}
    fixed |= {("duration",): {"timing.duration": keys.duration}} if keys.duration is not None else {}
    axes: list[Entries] = []
    for name, part in keys.variants.items():
        axes.append({("variants", name, one): values for one, values in part.items()})
    for key, listed in keys.grid.items():
        axes.append({("grid", key, k): {key: one} for k, one in enumerate(listed)})
    if keys.random:
        axes.append({("random", "keys"): next(_draws(keys.random))[1]})
    first = [next(iter(axis.items())) for axis in axes]
    check_settings(file, source, seed, fixed | dict(first))
    for k, axis in enumerate(axes):
        for path, values in list(axis.items())[1:]:
            check_settings(file, source, seed, fixed | dict([*first[:k], *first[k + 1 :], (path, values)]))


def check_settings(file: StudyFile[Any], source: Source, seed: int, entries: Entries) -> Scenario:
    """Return a scenario with the settings of some entries of a file.

    Raises InputError at the line of the entry that has the key which is wrong, else of the last one.
    """
    settings = _merged(plain(values) for values in entries.values())
    try:
        return Task(source, settings, seed).scenario()
    except InputError as error:
        own = [path for path, values in entries.items() if any(_within(error.key, key) for key in values)]
        path = (own or list(entries) or [("scenario",)])[-1]
        key = "" if not error.key or error.key in map(str, path) else f"{error.key}: "
        raise file.error(path, key + error.message.split("; set by override")[0]) from None


def _within(wrong: str | None, key: str) -> bool:
    return wrong is not None and (f"{wrong}.".startswith(f"{key}.") or f"{key}.".startswith(f"{wrong}."))


def _merged(parts: Any) -> dict[str, Any]:
    merged: dict[str, Any] = {}
    for part in parts:
        merged |= part
    return merged
