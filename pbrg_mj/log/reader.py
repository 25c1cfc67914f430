"""A log, whole or damaged, as arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from google.protobuf.message import DecodeError

from pbrg_mj.errors import InputError
from pbrg_mj.log import channels
from pbrg_mj.log.container import Damage, read_container
from pbrg_mj.log.fields import MESSAGES, Dims
from pbrg_mj.log.head import Embedded, opened
from pbrg_mj.log.payload import Payload
from pbrg_mj.log.run import OptimumSeries, Run, TickSeries, TimingSeries
from pbrg_mj.log.schemas import DTYPE, decode

TOPICS = {channels.TICK: "Tick", channels.OPTIMUM: "Optimum", channels.TIMING: "Timing"}


@dataclass
class _Contents:
    """What was found so far."""

    embedded: Embedded
    rows: dict[str, list[tuple[Any, ...]]] = field(default_factory=lambda: {name: [] for name in MESSAGES})
    damage: str | None = None


def read_run(path: str | Path) -> Run:
    """Read a log.

    A log that is cut or corrupted yields the ticks of its leading whole chunks, and the reason in
    `Run.damage`. Raises InputError when there is no such file, it is not a log of this package, a newer
    version wrote it, or it holds no whole tick.
    """
    path = Path(path)
    with opened(path) as (file, size):
        contents = _read_contents(file, size, str(path))
    return _assemble(contents, str(path))


def _read_contents(file: BinaryIO, size: int, path: str) -> _Contents:
    contents, dims = _Contents(Embedded(path)), None
    try:
        for item in read_container(file, size):
            if not isinstance(item, Payload):
                contents.embedded.keep(item)
            elif item.topic in TOPICS:
                dims = dims or contents.embedded.dims()
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


def _assemble(contents: _Contents, path: str) -> Run:
    head = contents.embedded.head(contents.damage)
    if not contents.rows["Tick"]:
        raise InputError(f"the log holds no whole tick ({contents.damage or 'the run never began'})", file=path)
    return Run(
        path=path,
        name=head.name,
        scenario=head.scenario,
        scenario_yaml=head.scenario_yaml,
        model_xml=head.model_xml,
        versions=head.versions,
        ticks=TickSeries(**_columns("Tick", contents, head.dims)),
        optima=OptimumSeries(**_columns("Optimum", contents, head.dims)),
        timings=TimingSeries(**_columns("Timing", contents, head.dims)),
        damage=contents.damage,
    )


def _columns(name: str, contents: _Contents, dims: Dims) -> dict[str, np.ndarray]:
    """Return one array per field, (messages, *shape)."""
    fields, rows = MESSAGES[name], contents.rows[name]
    columns = zip(*rows, strict=True) if rows else ((),) * len(fields)
    return {
        f.name: np.array(column, DTYPE[f.kind]).reshape(len(rows), *f.extent(dims))
        for f, column in zip(fields, columns, strict=True)
    }
