"""What is embedded in a log before the first tick: whether it is ours, and what it takes to run it again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from mcap.records import Attachment, Metadata

from pbrg_mj.errors import InputError
from pbrg_mj.log.read.existing import check_exists
from pbrg_mj.log.read.mcap_records import MAGIC
from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.ending import Ending
from pbrg_mj.log.schema.fields import SCHEMA_VERSION, Dims
from pbrg_mj.log.write.provenance import CENTRALIZED, PROCESSES
from pbrg_mj.plugins import is_centralized
from pbrg_mj.scenario.load import parse_scenario
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.text import counted

METADATA = {channels.RUN_METADATA, channels.VERSIONS_METADATA, channels.ENDING_METADATA}
ATTACHMENTS = {channels.SCENARIO_ATTACHMENT, channels.MODEL_ATTACHMENT}


@dataclass(frozen=True)
class LogHeader:
    """Everything embedded before the first tick."""

    name: str  # of the scenario
    scenario: Scenario
    scenario_yaml: str  # as run
    model_xml: str  # MJCF as run; empty for the ideal plant
    versions: dict[str, str]
    dims: Dims
    centralized: bool  # whether the governor sees the whole team
    processes: bool = False  # whether the robots were processes of their own


def most_messages(dims: Dims) -> int:
    """Return how many messages a tick has at most: one on each channel, and each robot's scan and events."""
    return 50 + 10 * dims["n"]


@dataclass
class EmbeddedFiles:
    """Attachments and metadata found so far."""

    path: str
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)

    def add(self, item: Attachment | Metadata) -> None:
        """Take one of them in, unless it is none of ours."""
        if isinstance(item, Metadata) and item.name in METADATA:
            self.metadata[item.name] = item.metadata
        elif isinstance(item, Attachment) and item.name in ATTACHMENTS:
            self.attachments[item.name] = item.data

    def dims(self) -> Dims:
        """Return the run's dimensions; raise InputError unless the log is ours and of a known version."""
        run = self.metadata.get(channels.RUN_METADATA)
        if run is None:
            raise InputError("this MCAP file is not a log of pbrg", file=self.path)
        try:
            version = int(run["schema"])
            dims = {"n": int(run["robots"]), "K": int(run["slots"]), "R": int(run["rows"])}
        except (KeyError, ValueError) as error:
            raise InputError("its metadata are damaged", file=self.path) from error
        if not 1 <= version <= SCHEMA_VERSION:
            allowed = f"this program reads versions up to {SCHEMA_VERSION}"
            raise InputError(f"the log has version {version}; {allowed}", file=self.path)
        if min(dims.values()) < 0:
            raise InputError("its metadata are damaged", file=self.path)
        return dims

    def ending(self) -> Ending | None:
        """Return what the log says about its end; it stands behind the last tick."""
        return Ending.read(self.metadata.get(channels.ENDING_METADATA, {}))

    def header(self, damage: str | None) -> LogHeader:
        """Return all of it, checked. Raises InputError when something is missing or contradicts itself."""
        if damage and channels.RUN_METADATA not in self.metadata:
            raise InputError(f"this is not a log of pbrg, or damaged at its start ({damage})", file=self.path)
        dims = self.dims()
        scenario_yaml = self._text(channels.SCENARIO_ATTACHMENT)
        if not scenario_yaml:
            raise InputError("the log holds no scenario", file=self.path)
        scenario = parse_scenario(scenario_yaml, file=f"{self.path}:{channels.SCENARIO_ATTACHMENT}")
        if scenario.robots != dims["n"]:
            counts = f"{counted(dims['n'], 'robot')}, its scenario has {scenario.robots}"
            raise InputError(f"the log contradicts itself: {counts}", file=self.path)
        return LogHeader(
            name=self.metadata[channels.RUN_METADATA].get("name", ""),
            scenario=scenario,
            scenario_yaml=scenario_yaml,
            model_xml=self._text(channels.MODEL_ATTACHMENT),
            versions=self.metadata.get(channels.VERSIONS_METADATA, {}),
            dims=dims,
            centralized=self._centralized(scenario),
            processes=self.metadata[channels.RUN_METADATA].get(PROCESSES) == "true",
        )

    def _centralized(self, scenario: Scenario) -> bool:
        """Return what the log says; earlier ones say nothing, and had no robot programs of other packages."""
        said = self.metadata[channels.RUN_METADATA].get(CENTRALIZED, "")
        return {"true": True, "false": False}.get(said, is_centralized(scenario.governor.kind))

    def _text(self, name: str) -> str:
        try:
            return self.attachments.get(name, b"").decode()
        except UnicodeDecodeError as error:
            raise InputError(f"the embedded {name} is not UTF-8", file=self.path) from error


@contextmanager
def open_mcap(path: Path) -> Iterator[tuple[BinaryIO, int]]:
    """Give the file, positioned behind MCAP's magic, and its size in bytes.

    Raises InputError when there is no such file, it cannot be read, or it is not an MCAP file.
    """
    check_exists(path)
    try:
        file = path.open("rb")
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=str(path)) from error
    with file:
        size = path.stat().st_size
        if size == 0:
            raise InputError("the file is empty", file=str(path))
        if file.read(len(MAGIC)) != MAGIC:
            raise InputError("this is not an MCAP file", file=str(path))
        yield file, size
