"""A recorded run as arrays: `open_run(path) -> Run`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import BinaryIO

import numpy as np

from pbrg_mj.errors import InputError
from pbrg_mj.log.read.columns import MessageColumns, Reduce
from pbrg_mj.log.read.header import EmbeddedFiles, most_messages, open_mcap
from pbrg_mj.log.read.mcap_records import DamageError, read_records
from pbrg_mj.log.read.series import LoggedSeries
from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.ending import Ending, ending_text, requested_ticks
from pbrg_mj.log.schema.fields import MESSAGES
from pbrg_mj.log.schema.message import LogMessage
from pbrg_mj.scenario.schema import Scenario


@dataclass(frozen=True)
class TickSeries(LoggedSeries):
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
class OptimumSeries(LoggedSeries):
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
class TimingSeries(LoggedSeries):
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
    reduced: dict[str, np.ndarray] = field(default_factory=dict)  # what `reduce` made of the columns, (T, ...)
    ending: Ending | None = None  # what the log says about its end; None when it says nothing, as after a kill
    centralized: bool = False  # whether its governor sees the whole team

    @property
    def length(self) -> int:
        """The number of ticks, also where only some of them are here: the last one's, counted from 1."""
        return int(self.ticks.index[-1]) + 1

    @property
    def ending_text(self) -> str:
        """Why the log ends where it does, in a few words."""
        return ending_text(self.ending, self.length, self.scenario)

    def part(self, first: int, last: int) -> Run:
        """Return the ticks in rows `first` to before `last`, with their optima and timings. A log's are read again."""
        ticks = self.ticks.rows(first, last)
        if not len(ticks.index):
            return replace(self, ticks=ticks, optima=self.optima.rows(0, 0), timings=self.timings.rows(0, 0))
        numbers = ticks.index[0], ticks.index[-1] + 1
        optima, timings = (np.searchsorted(one.index, numbers).tolist() for one in (self.optima, self.timings))
        return replace(self, ticks=ticks, optima=self.optima.rows(*optima), timings=self.timings.rows(*timings))


NOTHING: Mapping[str, Reduce] = MappingProxyType({})
TOPICS = {channels.TICK: "Tick", channels.OPTIMUM: "Optimum", channels.TIMING: "Timing"}


class _Contents:
    """What was found so far."""

    def __init__(self, path: str, reduce: Mapping[str, Reduce]):
        self.embedded = EmbeddedFiles(path)
        self.damage: str | None = None
        self.messages: dict[str, MessageColumns] = {}
        self._reduce, self._reached = reduce, dict.fromkeys(TOPICS.values(), -1)

    def add(self, item: LogMessage) -> None:
        """Take a message; raise DamageError when it cannot be read, or is out of order."""
        if not self.messages:
            self._start()
        self._since_tick = 0 if item.topic == channels.TICK else self._since_tick + 1
        if self._since_tick > self._most:
            raise DamageError(f"more than {self._most} messages belong to one tick")
        if item.topic not in TOPICS:
            return
        name = TOPICS[item.topic]
        one, ticks = self.messages[name], self.messages["Tick"].count
        place, first = f"message {one.count} on {item.topic}", self._reached[name] + 1
        if name == "Tick" and ticks == self._asked:
            raise DamageError(f"{place} is beyond the scenario's end")
        try:  # of every tick one message at most, and none of ticks that are not there
            self._reached[name] = one.add(item.data, first, first if name == "Tick" else ticks - 1)
        except IndexError as error:
            raise DamageError(f"{place} is out of order") from error
        except ValueError as error:
            raise DamageError(f"{place} cannot be read") from error

    def _start(self) -> None:
        """All that is embedded before the first tick is known by now."""
        header = self.embedded.header(None)
        self._asked, self._most, self._since_tick = requested_ticks(header.scenario), most_messages(header.dims), 0
        for name in MESSAGES:
            self.messages[name] = MessageColumns(name, header.dims, self._reduce.get(name, dict))


def open_run(path: str | Path, reduce: Mapping[str, Reduce] = NOTHING) -> Run:
    """Read a log as arrays, bit for bit what the run had: float64, int64, bool and text, time on the first axis.

    The log is read once and checked. Arrays of more than a few megabytes then lie in a temporary file, which goes with
    the run; each is held from when it is first asked for.

    TickSeries, OptimumSeries and TimingSeries give every array's shape and unit. A log that is cut or corrupted yields
    the ticks of its leading whole chunks, and the reason in `Run.damage`. Scans are read apart, by `read_scans`.

    `reduce` has functions by the messages' names. Each is given those messages' columns by name, some hundred rows at a
    time, and returns what is kept of them, perhaps nothing. The series lack the columns that it leaves out; what it
    makes of ticks under other names stands in `reduced`.

    Raises InputError when there is no such file, it is not a log of this package, a newer version wrote it, or it
    holds no whole tick.
    """
    path = Path(path)
    with open_mcap(path) as (file, size):
        contents = _read_contents(file, size, str(path), reduce)
    return _assemble(contents, str(path))


def _read_contents(file: BinaryIO, size: int, path: str, reduce: Mapping[str, Reduce]) -> _Contents:
    contents = _Contents(path, reduce)
    try:
        for item in read_records(file, size):
            if not isinstance(item, LogMessage):
                contents.embedded.add(item)
            else:
                contents.add(item)
    except DamageError as damage:
        contents.damage = str(damage)
    return contents


def _assemble(contents: _Contents, path: str) -> Run:
    header, messages = contents.embedded.header(contents.damage), contents.messages
    if not messages or not messages["Tick"].count:
        raise InputError(f"the log holds no whole tick ({contents.damage or 'the run never began'})", file=path)
    ticks, absent = messages["Tick"].columns(), messages["Tick"].absent
    own = {one.name for one in MESSAGES["Tick"]}
    return Run(
        path=path,
        name=header.name,
        scenario=header.scenario,
        scenario_yaml=header.scenario_yaml,
        model_xml=header.model_xml,
        versions=header.versions,
        ticks=TickSeries.of(ticks),
        optima=OptimumSeries.of(messages["Optimum"].columns()),
        timings=TimingSeries.of(messages["Timing"].columns()),
        damage=contents.damage,
        absent=absent,
        ending=contents.embedded.ending(),
        centralized=header.centralized,
        reduced={name: ticks[name] for name in ticks if name not in own},
    )
