"""A log, whole or damaged, as arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from google.protobuf.message import DecodeError
from mcap.records import Attachment, Metadata

from pbrg_mj.errors import InputError
from pbrg_mj.log import channels
from pbrg_mj.log.container import MAGIC, Damage, Payload, read_container
from pbrg_mj.log.fields import MESSAGES, SCHEMA_VERSION, Dims
from pbrg_mj.log.run import OptimumSeries, Run, TickSeries, TimingSeries
from pbrg_mj.log.schemas import DTYPE, decode
from pbrg_mj.scenario.load import parse_scenario

TOPICS = {channels.TICK: "Tick", channels.OPTIMUM: "Optimum", channels.TIMING: "Timing"}


@dataclass
class _Contents:
    """What was found so far."""

    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    rows: dict[str, list[tuple[Any, ...]]] = field(default_factory=lambda: {name: [] for name in MESSAGES})
    damage: str | None = None


def read_run(path: str | Path) -> Run:
    """Read a log.

    A log that is cut or corrupted yields the ticks of its leading whole chunks, and the reason in
    `Run.damage`. Raises InputError when there is no such file, it is not a log of this package, a newer
    version wrote it, or it holds no whole tick.
    """
    path = Path(path)
    if not path.exists():
        raise InputError("there is no such file", file=str(path))
    if not path.is_file():
        raise InputError("this is not a file but a folder or a device; give a log", file=str(path))
    try:
        with path.open("rb") as file:
            contents = _read_contents(file, path.stat().st_size, str(path))
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=str(path)) from error
    return _assemble(contents, str(path))


def _read_contents(file: BinaryIO, size: int, path: str) -> _Contents:
    if size == 0:
        raise InputError("the file is empty", file=path)
    if file.read(len(MAGIC)) != MAGIC:
        raise InputError("this is not an MCAP file", file=path)
    contents, dims = _Contents(), None
    try:
        for item in read_container(file, size):
            if isinstance(item, Metadata):
                contents.metadata[item.name] = item.metadata
            elif isinstance(item, Attachment):
                contents.attachments[item.name] = item.data
            elif item.topic in TOPICS:
                dims = dims or _dims(contents.metadata, path)
                _keep(contents, item, dims)
    except Damage as damage:
        contents.damage = str(damage)
    return contents


def _keep(contents: _Contents, item: Payload, dims: Dims) -> None:
    name = TOPICS[item.topic]
    rows = contents.rows[name]
    try:
        row = decode(name, item.data, dims)
    except (DecodeError, ValueError) as error:
        raise Damage(f"message {len(rows)} on {item.topic} cannot be read") from error
    index, ticks = int(row[0]), contents.rows["Tick"]
    in_order = index == len(rows) if name == "Tick" else 0 <= index < len(ticks)
    if not in_order:
        raise Damage(f"message {len(rows)} on {item.topic} is out of order")
    rows.append(row)


def _dims(metadata: dict[str, dict[str, str]], path: str) -> Dims:
    """Return the run's dimensions; raise InputError unless the log is ours and of a known version."""
    facts = metadata.get(channels.RUN_METADATA)
    if facts is None:
        raise InputError("this MCAP file is not a log of pbrg", file=path)
    try:
        version = int(facts["schema"])
        dims = {"n": int(facts["robots"]), "K": int(facts["slots"]), "R": int(facts["rows"])}
    except (KeyError, ValueError) as error:
        raise InputError("its metadata are damaged", file=path) from error
    if not 1 <= version <= SCHEMA_VERSION:
        allowed = f"this program reads versions up to {SCHEMA_VERSION}"
        raise InputError(f"the log has version {version}; {allowed}", file=path)
    if min(dims.values()) < 0:
        raise InputError("its metadata are damaged", file=path)
    return dims


def _assemble(contents: _Contents, path: str) -> Run:
    if contents.damage and channels.RUN_METADATA not in contents.metadata:
        raise InputError(f"this is not a log of pbrg, or damaged at its start ({contents.damage})", file=path)
    dims = _dims(contents.metadata, path)
    scenario_yaml = _text(contents, channels.SCENARIO_ATTACHMENT, path)
    if not scenario_yaml:
        raise InputError("the log holds no scenario", file=path)
    scenario = parse_scenario(scenario_yaml, file=f"{path}:{channels.SCENARIO_ATTACHMENT}")
    if scenario.robots != dims["n"]:
        counts = f"{dims['n']} robots, its scenario has {scenario.robots}"
        raise InputError(f"the log contradicts itself: {counts}", file=path)
    if not contents.rows["Tick"]:
        raise InputError(f"the log holds no whole tick ({contents.damage or 'the run never began'})", file=path)
    return Run(
        path=path,
        name=contents.metadata[channels.RUN_METADATA].get("name", ""),
        scenario=scenario,
        scenario_yaml=scenario_yaml,
        model_xml=_text(contents, channels.MODEL_ATTACHMENT, path),
        versions=contents.metadata.get(channels.VERSIONS_METADATA, {}),
        ticks=TickSeries(**_columns("Tick", contents, dims)),
        optima=OptimumSeries(**_columns("Optimum", contents, dims)),
        timings=TimingSeries(**_columns("Timing", contents, dims)),
        damage=contents.damage,
    )


def _text(contents: _Contents, name: str, path: str) -> str:
    try:
        return contents.attachments.get(name, b"").decode()
    except UnicodeDecodeError as error:
        raise InputError(f"the embedded {name} is not UTF-8", file=path) from error


def _columns(name: str, contents: _Contents, dims: Dims) -> dict[str, np.ndarray]:
    """Return one array per field, (messages, *shape)."""
    fields, rows = MESSAGES[name], contents.rows[name]
    columns = zip(*rows, strict=True) if rows else ((),) * len(fields)
    return {
        f.name: np.array(column, DTYPE[f.kind]).reshape(len(rows), *f.extent(dims))
        for f, column in zip(fields, columns, strict=True)
    }
