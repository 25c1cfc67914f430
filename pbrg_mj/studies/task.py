"""One run of a study: what it takes to make it, and a digest by which it is known again."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from pbrg_mj.api.scenario import Scenario, override_texts
from pbrg_mj.scenario.bundled import bundled_file
from pbrg_mj.scenario.load import load_text, read_text, scenario_text

Settings = Mapping[str, Any]  # values by dotted keys of a scenario


@dataclass(frozen=True)
class Source:
    """A scenario's or a family's text, so that a run depends on no file any more."""

    name: str  # the bundled name, or the file's stem
    text: str  # YAML
    file: str  # for errors
    argument: str  # what `pbrg run` takes

    @property
    def is_bundled(self) -> bool:
        """Whether every installation has it under this name."""
        file = bundled_file(self.name)
        return file is not None and read_text(file) == self.text

    @classmethod
    def of(cls, argument: str, folder: Path) -> Source:
        """Return a scenario by its bundled name or its file, which is sought in `folder` first. Raises InputError."""
        beside = folder / argument
        where = str(beside) if beside.is_file() else argument
        text, name, file = scenario_text(where)
        return cls(name, text, file, where)

    @classmethod
    def bundled(cls, name: str) -> Source | None:
        """Return the bundled scenario of that name, whatever files there are beside; None without."""
        name = name.removesuffix(".yaml")
        file = bundled_file(name)
        return None if file is None else cls(name, read_text(file), str(file), name)


@dataclass(frozen=True)
class Task:
    """One run: a scenario with settings of its own and a seed."""

    source: Source
    settings: Settings
    seed: int
    labels: Mapping[str, Any] = field(default_factory=dict)  # columns of its record that say what it is

    @cached_property
    def overrides(self) -> tuple[str, ...]:
        """The settings and the seed as `path.to.key=value`."""
        return tuple(override_texts({**self.settings, "seed": self.seed}))

    @cached_property
    def digest(self) -> str:
        """What tells the run from all others: the same scenario, settings and seed have the same one."""
        whole = json.dumps([self.source.name, self.source.text, self.overrides])
        return hashlib.sha256(whole.encode()).hexdigest()[:20]

    def scenario(self) -> Scenario:
        """Return the scenario to run. Raises InputError."""
        source = self.source
        return Scenario(load_text(source.text, source.name, self.overrides, file=source.file))

    def command(self, log: str) -> str:
        """Return the command line that makes the run's log."""
        from shlex import join

        settings = [part for text in override_texts(self.settings) for part in ("--set", text)]
        return join(["pbrg", "run", self.source.argument, "--seed", str(self.seed), *settings, "-o", log])
