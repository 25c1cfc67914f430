"""Scenarios: the bundled ones, those in files, worlds drawn from families, and changes to them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

from pbrg_mj.analysis.output_file import write_text_atomically
from pbrg_mj.errors import InputError
from pbrg_mj.loop.certificate_warnings import certificate_warnings
from pbrg_mj.loop.governor_warnings import governor_warnings
from pbrg_mj.loop.network_warnings import network_warnings
from pbrg_mj.loop.resources import available_bytes, resource_warnings, run_bytes
from pbrg_mj.loop.response_warnings import response_warnings
from pbrg_mj.loop.stability_warnings import stability_warnings, step_bound
from pbrg_mj.plugins import is_centralized
from pbrg_mj.scenario.bundled import bundled_families, bundled_scenarios
from pbrg_mj.scenario.families.json_schema import family_json_schema
from pbrg_mj.scenario.load import LoadedScenario, load_scenario, load_text
from pbrg_mj.scenario.parse.document import write_document
from pbrg_mj.scenario.schema import Scenario as Settings
from pbrg_mj.scenario.schema.json_schema import json_schema
from pbrg_mj.text import counted

Overrides = Mapping[str, Any] | Sequence[str]


@dataclass(frozen=True)
class Scenario:
    """One run, completely described: what `load` returns and `run` takes."""

    loaded: LoadedScenario

    @property
    def name(self) -> str:
        """The bundled name, or the file's stem."""
        return self.loaded.name

    @property
    def settings(self) -> Settings:
        """Every key as frozen, validated data: `scenario.settings.governor.rounds`."""
        return self.loaded.scenario

    @property
    def yaml(self) -> str:
        """The scenario as YAML text, with the overrides in it."""
        return self.loaded.yaml_text

    @property
    def family_yaml(self) -> str | None:
        """The YAML text of the family that the world was drawn from; None if it was not drawn."""
        return self.loaded.family and self.loaded.family.text

    def override(
        self, overrides: Overrides = (), *, seed: int | None = None, duration: float | None = None
    ) -> Scenario:
        """Return a copy with other values; the arguments are those of `load`. Raises InputError.

        Of a world that was drawn, another seed draws another world; other values change no more than themselves.
        """
        texts = override_texts(overrides, seed, duration)
        if family := self.loaded.family:
            return Scenario(load_text(family.text, self.name, [*family.overrides, *texts], file=family.file))
        return Scenario(load_text(self.yaml, self.name, texts, file=self.name))

    def warnings(self) -> list[str]:
        """Return one line for everything that makes a run likely to fail; empty when no risk is known."""
        one = self.settings
        return [
            *resource_warnings(one),
            *certificate_warnings(one),
            *governor_warnings(one),
            *network_warnings(one),
            *stability_warnings(one),
            *response_warnings(one),
        ]

    def step_bound(self) -> str:
        """Return one line: how long a round of the distributed governor is and may be, and what that rests on."""
        return step_bound(self.settings)

    def __repr__(self) -> str:
        """Name the scenario."""
        one = self.settings
        return f"<Scenario {self.name}: {counted(one.robots, 'robot')}, {one.plant} plant, {one.timing.duration:g} s>"


@dataclass(frozen=True)
class BundledScenario:
    """A line of `list_scenarios`."""

    name: str
    description: str
    robots: int | None  # None: drawn
    plant: str
    duration_s: float
    family: bool = False  # of worlds: every seed draws one
    governor: str = ""
    centralized: bool = False  # whether that governor sees the whole team


def list_scenarios() -> list[BundledScenario]:
    """Return the bundled scenarios and families of worlds, sorted by name."""
    listed = []
    for name, file in sorted((bundled_scenarios() | bundled_families()).items()):
        loaded = load_scenario(file)
        one, family, kind = loaded.scenario, loaded.family is not None, loaded.scenario.governor.kind
        description, robots = " ".join(one.description.split()), None if family else one.robots
        facts = one.timing.duration, family, kind, is_centralized(kind)
        listed.append(BundledScenario(name, description, robots, one.plant, *facts))
    return listed


def load(
    source: str | Path | Mapping[str, Any],
    overrides: Overrides = (),
    *,
    seed: int | None = None,
    duration: float | None = None,
) -> Scenario:
    """Return a scenario.

    `source` is a YAML file, the name of a bundled scenario, or the data themselves as nested mappings. `overrides` are
    either `{"path.to.key": value}` or texts `path.to.key=value` as on the command line; entries of lists go by their
    index from 0. `seed` and `duration` [s] stand for the keys `seed` and `timing.duration`. Of a family of worlds the
    seed draws the world.

    Raises InputError: one line with file, line, key, what is wrong and what is allowed.
    """
    texts = override_texts(overrides, seed, duration)
    if isinstance(source, Mapping):
        return Scenario(load_text(write_document(_plain(source)), "scenario", texts, file="<scenario>"))
    return Scenario(load_scenario(source, texts))


def draw(
    family: str | Path | Mapping[str, Any],
    seed: int = 1,
    overrides: Overrides = (),
    *,
    path: str | Path | None = None,
    force: bool = False,
) -> Scenario:
    """Return the world that a seed draws from a family: what `load` returns, which takes the same `overrides`.

    Its YAML is written to `path`, if one is given; `force` allows to replace a file that exists. Raises InputError,
    also for a scenario that is no family.
    """
    world = load(family, overrides, seed=seed)
    if world.family_yaml is None:
        raise InputError(f"{world.name} has no section `draw`; allowed: a family of worlds (see: pbrg list)")
    if path is not None:
        if Path(path).exists() and not force:
            raise InputError("is there already; allowed: a new name, or --force", file=str(path))
        write_text_atomically(Path(path), world.yaml)
    return world


def validate(source: Scenario | str | Path | Mapping[str, Any]) -> list[str]:
    """Return a line for everything that makes a run likely to fail.

    Raises InputError as `load` does, and what `run` raises when it puts the run together: that is done here, too, where
    there is the memory.
    """
    from pbrg_mj.loop.simulation import Simulation  # as long to import as all else

    scenario = source if isinstance(source, Scenario) else load(source)
    if run_bytes(scenario.settings) <= available_bytes():  # else it is a warning: another machine may have it
        Simulation.build(scenario.settings)
    return scenario.warnings()


def schema(*, family: bool = False) -> dict[str, Any]:
    """Return the JSON Schema of a scenario: every key with its meaning, its unit (`x-unit`), default and bounds.

    `family`: that of a family of worlds, with the section `draw`.
    """
    return family_json_schema() if family else json_schema()


def template() -> str:
    """Return the YAML text of a small scenario with comments: a start for one of your own."""
    return files("pbrg_mj.scenario").joinpath("template.yaml").read_text(encoding="utf-8")


def write_schema(path: str | Path, *, family: bool = False) -> None:
    """Write the JSON Schema to a file. Raises InputError when it cannot."""
    write_text_atomically(Path(path), json.dumps(schema(family=family), indent=2) + "\n")


def write_template(path: str | Path, *, force: bool = False) -> None:
    """Write the template to a file. Raises InputError when the file is there, unless `force`, or cannot be written."""
    if Path(path).exists() and not force:
        raise InputError("is there already; allowed: a new name, or --force", file=str(path))
    write_text_atomically(Path(path), template())


def bundled_names() -> list[str]:
    """Return the names of the bundled scenarios and families, sorted, without reading them."""
    return sorted(bundled_scenarios() | bundled_families())


def as_scenario(scenario: Scenario | str | Path) -> Scenario:
    """Return the scenario itself, or the one that is named."""
    return scenario if isinstance(scenario, Scenario) else load(scenario)


def override_texts(overrides: Overrides, seed: int | None = None, duration: float | None = None) -> list[str]:
    """Return overrides as `path.to.key=value`; the arguments are those of `load`."""
    texts = [_text(*item) for item in overrides.items()] if isinstance(overrides, Mapping) else list(overrides)
    shorthands = {"seed": seed, "timing.duration": duration}
    return texts + [f"{key}={value}" for key, value in shorthands.items() if value is not None]


def _text(key: str, value: Any) -> str:
    """Return `key=value`; JSON is YAML, but for line breaks such as U+2028: YAML folds them unless escaped."""
    text = json.dumps(_plain(value), ensure_ascii=False)
    return f"{key}=" + "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in text)


def _plain(value: Any) -> Any:
    """Return mappings, lists and scalars of other kinds, such as NumPy's, as Python's own."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(item) for item in value]
    if value is not None and not isinstance(value, str | int | float):
        raise InputError(f"{value!r} is no value of a scenario; allowed: numbers, texts, true, false, lists, mappings")
    return value
