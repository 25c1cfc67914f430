"""A recorded run as arrays: `open_run(path) -> Run`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from google.protobuf.message import DecodeError

from pbrg_mj.errors import InputError
from pbrg_mj.log.read.header import Embedded, open_mcap
from pbrg_mj.log.read.mcap_records import DamageError, read_records
from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.ending import Ending, how_it_ended
from pbrg_mj.log.schema.fields import MESSAGES, Dims
from pbrg_mj.log.schema.message import LogMessage
from pbrg_mj.log.schema.protobuf import DTYPE, absent_fields, decode
from pbrg_mj.scenario.schema import Scenario


@dataclass(frozen=True)
class TickSeries:
    """One row per tick; T ticks, n robots, K half-space slots per robot, R constraint rows per robot."""

    index: np.ndarray  # (T,) int64
    time: np.ndarray  # (T,) [s]
    body_pose_true: np.ndarray  # (T, n, 3) x, y [m], heading [rad]
    hand_true: np.ndarray  # (T, n, 2) q [m]
    wheel_speed: np.ndarray  # (T, n, 2) left, right [rad/s]
    wall_margin: np.ndarray  # (T, n) [m] truth: hand point to nearest wall's face, less the clearance
    wall_contact: np.ndarray  # (T, n) bool, truth
    body_pose: np.ndarray  # (T, n, 3) as the camera reports it
    hand: np.ndarray  # (T, n, 2) q from body_pose [m]
    pose_frame: np.ndarray  # (T,) int64
    scan_frame: np.ndarray  # (T,) int64
    half_space_G: np.ndarray  # (T, n, K, 2)
    half_space_h: np.ndarray  # (T, n, K) [m]
    half_space_active: np.ndarray  # (T, n, K) bool
    half_space_binds: np.ndarray  # (T, n, K, n) bool: which robots each must hold for
    p: np.ndarray  # (T, n, 2) [m]
    xi: np.ndarray  # (T, n, 2) [m]
    reference: np.ndarray  # (T, 2) the operator's r [m]
    m: np.ndarray  # (T, n, 2) governed references [m]
    multipliers: np.ndarray  # (T, n, R)
    status: np.ndarray  # (T,) str
    rounds: np.ndarray  # (T,) int64
    bytes_sent: np.ndarray  # (T, n) int64
    lost: np.ndarray  # (T, n) int64 neighbours each robot counts as lost
    storage: np.ndarray  # (T,) V at the leaders' m [m^2]
    storage_change: np.ndarray  # (T,) V less V a tick ago, at the m applied then [m^2]
    worst_row: np.ndarray  # (T,) largest row of g at the leaders' m [m]
    consensus_spread: np.ndarray  # (T,) [m]
    stationarity: np.ndarray  # (T,) KKT residual [m]
    complementarity: np.ndarray  # (T,) KKT residual [m^2]
    velocity: np.ndarray  # (T, n, 2) u [m/s]
    command: np.ndarray  # (T, n, 2) wheel voltages [V] or speeds [rad/s]; u [m/s] in the ideal plant
    winding_up: np.ndarray  # (T, n) bool: xi grows although the wheels do not follow u
    flow_primal_storage: np.ndarray  # (T,) of the flow's own velocity [m^2/s^2], NaN unless known
    flow_dual_storage: np.ndarray  # (T,) [m^2/s^2], NaN unless known
    flow_primal_dissipation: np.ndarray  # (T,) [m^2/s^3], >= 0: passive; NaN unless known
    flow_dual_dissipation: np.ndarray  # (T,) [m^2/s^3], >= 0: passive; NaN unless known
    moving_margin: np.ndarray  # (T, n) [m] truth: hand point to nearest moving box, less the clearance
    moving_contact: np.ndarray  # (T, n) bool, truth
    robot_contact: np.ndarray  # (T, n) bool, truth


@dataclass(frozen=True)
class OptimumSeries:
    """One row per reference tick; S of them."""

    index: np.ndarray  # (S,) int64, the tick's index
    time: np.ndarray  # (S,) [s]
    m: np.ndarray  # (S, 2) m* [m], NaN unless solved
    cost: np.ndarray  # (S,) [m^2], NaN unless solved
    multipliers: np.ndarray  # (S, n, R), NaN unless solved
    status: np.ndarray  # (S,) str: solved, infeasible, failed
    solver_status: np.ndarray  # (S,) str
    primal_storage: np.ndarray  # (S,) [m^2], NaN unless known
    dual_storage: np.ndarray  # (S,) [m^2], NaN unless known
    primal_dissipation: np.ndarray  # (S,) [m^2/s], >= 0: passive; NaN unless known
    dual_dissipation: np.ndarray  # (S,) [m^2/s], >= 0: passive; NaN unless known


@dataclass(frozen=True)
class TimingSeries:
    """Wall-clock time of each stage of a tick [s]; empty when the scenario switched timings off."""

    index: np.ndarray  # (T,) int64, the tick's index; all others (T,) [s]
    sense: np.ndarray
    perceive: np.ndarray
    govern: np.ndarray
    control: np.ndarray
    advance: np.ndarray
    certify: np.ndarray
    reference_build: np.ndarray
    reference_solve: np.ndarray
    reference_balance: np.ndarray


@dataclass(frozen=True)
class Run:
    """A log as arrays.

    A row of `ticks` is a tick; `optima` and `timings` have the tick's number in their `index`, which is its row in
    `ticks`.
    """

    path: str
    name: str  # of the scenario
    scenario: Scenario
    scenario_yaml: str  # as run
    model_xml: str  # MJCF as run; empty for the ideal plant
    versions: dict[str, str]  # package name -> version, with python and platform
    ticks: TickSeries
    optima: OptimumSeries
    timings: TimingSeries
    damage: str | None  # why the file ends early, in one line; None for a complete log
    absent: frozenset[str] = frozenset()  # fields of `ticks` that the log is too old to have: NaN or false here
    ending: Ending | None = None  # what the log says about its end; None when it says nothing, as after a kill

    @property
    def how_it_ended(self) -> str:
        """Why the log ends where it does, in a few words."""
        return how_it_ended(self.ending, len(self.ticks.time), self.scenario)


TOPICS = {channels.TICK: "Tick", channels.OPTIMUM: "Optimum", channels.TIMING: "Timing"}


@dataclass
class _Contents:
    """What was found so far."""

    embedded: Embedded
    rows: dict[str, list[tuple[Any, ...]]] = field(default_factory=lambda: {name: [] for name in MESSAGES})
    damage: str | None = None
    absent: frozenset[str] = frozenset()


def open_run(path: str | Path) -> Run:
    """Read a log into arrays, bit for bit what the run had: float64, int64, bool and text, time on the first axis.

    TickSeries, OptimumSeries and TimingSeries give every array's shape and unit. A log that is cut or corrupted yields
    the ticks of its leading whole chunks, and the reason in `Run.damage`. Scans are read apart, by `read_scans`.

    Raises InputError when there is no such file, it is not a log of this package, a newer version wrote it, or it
    holds no whole tick.
    """
    path = Path(path)
    with open_mcap(path) as (file, size):
        contents = _read_contents(file, size, str(path))
    return _assemble(contents, str(path))


def _read_contents(file: BinaryIO, size: int, path: str) -> _Contents:
    contents, dims = _Contents(Embedded(path)), None
    try:
        for item in read_records(file, size):
            if not isinstance(item, LogMessage):
                contents.embedded.add(item)
            elif item.topic in TOPICS:
                dims = dims or contents.embedded.dims()
                _add_row(contents, item, dims)
    except DamageError as damage:
        contents.damage = str(damage)
    return contents


def _add_row(contents: _Contents, item: LogMessage, dims: Dims) -> None:
    name = TOPICS[item.topic]
    rows = contents.rows[name]
    try:
        row = decode(name, item.data, dims)
        if name == "Tick" and not rows:
            contents.absent = absent_fields(name, item.data)
    except (DecodeError, ValueError) as error:
        raise DamageError(f"message {len(rows)} on {item.topic} cannot be read") from error
    index, ticks = int(row[0]), contents.rows["Tick"]
    in_order = index == len(rows) if name == "Tick" else 0 <= index < len(ticks)
    if not in_order:
        raise DamageError(f"message {len(rows)} on {item.topic} is out of order")
    rows.append(row)


def _assemble(contents: _Contents, path: str) -> Run:
    header = contents.embedded.header(contents.damage)
    if not contents.rows["Tick"]:
        raise InputError(f"the log holds no whole tick ({contents.damage or 'the run never began'})", file=path)
    return Run(
        path=path,
        name=header.name,
        scenario=header.scenario,
        scenario_yaml=header.scenario_yaml,
        model_xml=header.model_xml,
        versions=header.versions,
        ticks=TickSeries(**_columns("Tick", contents, header.dims)),
        optima=OptimumSeries(**_columns("Optimum", contents, header.dims)),
        timings=TimingSeries(**_columns("Timing", contents, header.dims)),
        damage=contents.damage,
        absent=contents.absent,
        ending=contents.embedded.ending(),
    )


def _columns(name: str, contents: _Contents, dims: Dims) -> dict[str, np.ndarray]:
    """Return one array per field, (messages, *shape)."""
    fields, rows = MESSAGES[name], contents.rows[name]
    columns = zip(*rows, strict=True) if rows else ((),) * len(fields)
    return {
        f.name: np.array(column, DTYPE[f.kind]).reshape(len(rows), *f.extent(dims))
        for f, column in zip(fields, columns, strict=True)
    }
