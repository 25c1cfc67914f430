"""SUITE.yaml: families of worlds x governors x networks x seeds; train and held-out seeds apart."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from pbrg_mj.analysis.output_file import write_text_atomically
from pbrg_mj.errors import InputError, PlugInError
from pbrg_mj.governor.check import governor_report
from pbrg_mj.plugins import ROBOT_PROGRAM, find, installed, is_centralized
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.scenario.schema.base import Section
from pbrg_mj.studies.document import StudyFile, plain, read_study
from pbrg_mj.studies.sweep_plan import Entries, Seed, Values, always_set, check_settings, seed_list, sources
from pbrg_mj.studies.task import Source, Task

GROUPS = ("held_out", "train")
SCENARIOS = "scenarios"
"""Folder beside a suite's file in a benchmark: scenarios that are not bundled, by their names in the logs'."""
Seeds = str | Seed | tuple[Seed, ...]


class GovernorEntry(Section):
    """A governor of the suite."""

    settings: Values = Field(description="values of keys by their dotted names")
    tuning: str = Field(description="the sweep by which its settings were found, and where that is published")
    networks: tuple[str, ...] | None = Field(
        default=None, description="those it runs on, all if not given; `none` on one stands for all", min_length=1
    )


class Quick(Section):
    """What `--quick` takes of a suite."""

    description: str | None = Field(default=None, description="the suite's if not given")
    scenario: tuple[str, ...]
    train: Seeds
    held_out: Seeds
    duration: Annotated[float, Field(gt=0)] | None = Field(default=None, description="the suite's if not given")
    governors: tuple[str, ...]
    networks: tuple[str, ...]


class SuiteKeys(Section):
    """A suite: every governor on every network in every world."""

    description: str = Field(default="", description="one sentence")
    scenario: tuple[str, ...] = Field(
        description="families and scenarios: bundled names, or files beside this one", min_length=1
    )
    train: Seeds = Field(description="seeds to tune on")
    held_out: Seeds = Field(description="other seeds, to compare by")
    seed_stride: Annotated[int, Field(ge=0, lt=2**32)] = Field(
        default=0, description="added to both for each scenario before: families draw teams alike for equal seeds"
    )
    duration: Annotated[float, Field(gt=0)] | None = Field(default=None, description="simulated time [s]")
    set: Values = Field(default={}, description="values of keys, the same in all runs")
    governors: dict[str, GovernorEntry] = Field(
        description="by name; `none` is what settling times are compared with", min_length=1
    )
    networks: dict[str, Values] = Field(default={"perfect": {}}, description="by name: values of keys", min_length=1)
    quick: Quick | None = Field(default=None, description="a smaller suite of these")


@dataclass(frozen=True)
class Suite:
    """A suite's runs."""

    file: StudyFile[SuiteKeys]
    tasks: tuple[Task, ...]  # labelled `group`, `governor`, `network`
    logs: tuple[str, ...]  # their names
    tunings: dict[str, str]
    centralized: frozenset[str]  # governors that see the whole team

    @property
    def title(self) -> str:
        """What stands above its table: nothing of the file's name, which is another one in a benchmark's folder."""
        return self.file.keys.description or "Benchmark"


def bundled_suites() -> dict[str, Path]:
    """Return the bundled suites' files by name."""
    folder = Path(str(files("pbrg_mj.studies").joinpath("suites")))
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


def read_suite(source: str | Path, *, quick: bool = False, copies: Path | None = None) -> Suite:
    """Return the suite of that bundled name, or in that file. Raises InputError.

    `copies`: the folder of `copy_scenarios`, the one place where scenarios that are not bundled are sought then.
    """
    bundled = bundled_suites()
    if not Path(source).is_file() and str(source) not in bundled:
        raise InputError(f"{str(source)!r} is neither a file nor a suite; allowed: {', '.join(bundled)}, or a file")
    path = Path(source) if Path(source).is_file() else bundled[str(source)]
    return _suite(_read(path, quick=quick), copies)


def copy_scenarios(suite: Suite, folder: Path) -> None:
    """Write the suite's scenarios that are not bundled into `scenarios/`: with them the folder is whole elsewhere."""
    there = folder / SCENARIOS
    for old in there.glob("*.yaml"):
        old.unlink()
    for source in {task.source.name: task.source for task in suite.tasks}.values():
        if not source.is_bundled:
            there.mkdir(exist_ok=True)
            write_text_atomically(there / f"{source.name}.yaml", source.text)


def bundled_keys(*, quick: bool) -> dict[str, SuiteKeys]:
    """Return the bundled suites' keys by name, without a look at the scenarios that they name."""
    return {name: _read(path, quick=quick).keys for name, path in bundled_suites().items()}


def _read(path: Path, *, quick: bool) -> StudyFile[SuiteKeys]:
    file = read_study(path, SuiteKeys)
    _check(file)
    return _shortened(file) if quick else file


def _suite(file: StudyFile[SuiteKeys], copies: Path | None) -> Suite:
    keys, scenarios, always = file.keys, sources(file, copies), always_set(file.keys)
    stems = [_short_name(source) for source in scenarios]
    if twice := [k for k, stem in enumerate(stems) if stem in stems[:k]]:
        raise file.error(("scenario", twice[0]), f"is a second {stems[twice[0]]}; allowed: each name once")
    seeds = {group: seed_list(file, group) for group in GROUPS}
    _check_seeds(file, seeds, len(scenarios))
    kinds = _governor_kinds(file, scenarios, seeds["train"][0])
    tasks = [
        Task(
            source,
            always | plain(settings) | plain(entry.settings),
            seed + k * keys.seed_stride,
            {"group": group, "governor_name": governor, "network_name": network},
        )
        for group in GROUPS
        for seed in seeds[group]  # a seed after the other: what was made before a kill is a whole comparison
        for network, settings in keys.networks.items()
        for governor, entry in keys.governors.items()
        if network in (entry.networks or keys.networks)
        for k, source in enumerate(scenarios)
    ]
    centralized = frozenset(name for name, kind in kinds.items() if is_centralized(kind))
    tunings = {name: entry.tuning for name, entry in keys.governors.items()}
    return Suite(file, tuple(tasks), tuple(map(_log_name, tasks)), tunings, centralized)


def _check_seeds(file: StudyFile[SuiteKeys], seeds: Mapping[str, Sequence[int]], scenarios: int) -> None:
    """Raise InputError for a seed to tune on and to compare by, and for one that the stride gives two scenarios."""
    stride = file.keys.seed_stride
    own = {group: {seed + k * stride for seed in listed for k in range(scenarios)} for group, listed in seeds.items()}
    if both := own["train"] & own["held_out"]:
        raise file.error(("held_out",), f"has the seed {min(both)} of `train`; allowed: other ones")
    for group, listed in seeds.items():
        if stride and len(own[group]) < scenarios * len(listed):
            raise file.error(("seed_stride",), f"gives two scenarios the same seed of `{group}`; allowed: 0, or more")
        if max(own[group]) >= 2**63:
            raise file.error((group,), f"goes up to {max(own[group])}; allowed: below 2^63")


def _governor_kinds(file: StudyFile[SuiteKeys], scenarios: Sequence[Source], seed: int) -> dict[str, str]:
    """Return each governor's `governor.kind`; try each with each network, and each scenario with the first of both.

    What a scenario does not take of another governor shows as a run that fails. Raises InputError, PlugInError for a
    robot program that breaks the protocol.
    """
    keys, kinds = file.keys, dict[str, str]()
    entries: Entries = {("set", key): {key: one} for key, one in always_set(keys).items()}
    for governor, entry in keys.governors.items():
        for network, settings in keys.networks.items():
            chosen: Entries = {("networks", network): settings, ("governors", governor): entry.settings}
            for source in scenarios if not kinds else scenarios[:1]:
                found = check_settings(file, source, seed, entries | chosen).settings
                if governor not in kinds and found.governor.kind in installed(ROBOT_PROGRAM):
                    _check_program(governor, found)
                kinds[governor] = found.governor.kind
    return kinds


def _check_program(governor: str, scenario: Scenario) -> None:
    """Raise PlugInError where an installed robot program breaks the protocol, such as by what its robots share."""
    kind, options = scenario.governor.kind, scenario.governor.options
    report = governor_report(find(ROBOT_PROGRAM, kind), scenario, options)
    failures = [failure for check in report.checks for failure in check.failures]
    if failures:
        raise PlugInError(f"governor {governor!r} of the suite: {kind} breaks the protocol: {failures[0]}")


def _check(file: StudyFile[SuiteKeys]) -> None:
    quick, keys = file.keys.quick, file.keys
    for part in ("governors", "networks"):
        known = getattr(keys, part)
        if len({plain_name(name) for name in known}) < len(known):
            raise file.error((part,), "has two names that differ in blanks or punctuation alone")
        for k, name in enumerate(getattr(quick, part) if quick else ()):
            if name not in known:
                raise file.error(("quick", part, k), f"is {name!r}; allowed: {', '.join(known)}")
    for governor, entry in keys.governors.items():
        for k, name in enumerate(entry.networks or ()):
            if name not in keys.networks:
                raise file.error(("governors", governor, "networks", k), f"is {name!r}; allowed: {_listed(keys)}")


def _listed(keys: SuiteKeys) -> str:
    return ", ".join(keys.networks)


def _shortened(file: StudyFile[SuiteKeys]) -> StudyFile[SuiteKeys]:
    quick, keys = file.keys.quick, file.keys
    if quick is None:
        raise file.error(("quick",), "is missing: this suite has no smaller one")
    chosen: dict[str, Any] = {name: getattr(quick, name) for name in ("scenario", "train", "held_out")}
    chosen["duration"] = quick.duration or keys.duration
    chosen["description"] = keys.description if quick.description is None else quick.description
    for part in ("governors", "networks"):
        chosen[part] = {name: getattr(keys, part)[name] for name in getattr(quick, part)}
    return StudyFile(file.path, keys.model_copy(update=chosen), file.document, file.content)


def _log_name(task: Task) -> str:
    labels = (task.labels["governor_name"], task.labels["network_name"], _short_name(task.source))
    return "-".join([*map(plain_name, labels), str(task.seed)]) + ".mcap"


def _short_name(source: Source) -> str:
    return source.name.rsplit("/", 1)[-1]


def plain_name(name: str) -> str:
    """Return a name for files and links: blanks and punctuation are underscores. A suite's names differ in the rest."""
    return re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
