"""The log's time series under their public names: quantity, then unit. docs/export.md explains each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from functools import cache
from itertools import product
from operator import attrgetter
from typing import Any

import numpy as np

from pbrg_mj.analysis.metrics.per_tick import certificate_rows, per_tick
from pbrg_mj.governor.certificate.evaluate import NAMES
from pbrg_mj.log.read.run import Run
from pbrg_mj.log.read.series import LoggedSeries
from pbrg_mj.scenario.schema import Scenario

XY = ("x", "y")
SIDE = ("left", "right")

Axes = tuple[tuple[str, ...] | None, ...]
Table = Sequence[tuple[str, str, Callable[[Any], np.ndarray], Axes]]  # name, unit, values, what the axes run over


@dataclass(frozen=True)
class Series:
    """One quantity over time: `values[s]` belongs to tick `index[s]`. They are made whenever they are asked for.

    `axes` names what the axes after the first run over: a tuple of components, or None for a count from 1.
    """

    name: str
    unit: str
    index: np.ndarray  # (S,) int64
    read: Callable[[], np.ndarray]
    axes: Axes = ()

    @property
    def values(self) -> np.ndarray:
        """The values (S, ...)."""
        return self.read()

    @property
    def key(self) -> str:
        """Name and unit: `q_true_m`."""
        return "_".join(part for part in (self.name, self.unit) if part)

    def columns(self) -> Iterator[tuple[str, np.ndarray]]:
        """Yield every component as a flat column (S,), named like `q_true_x_1_m`: components first, then counts."""
        values = self.values
        for place in product(*(range(size) for size in values.shape[1:])):
            labels = [axis[i] for axis, i in zip(self.axes, place, strict=True) if axis]
            numbers = [str(i + 1) for axis, i in zip(self.axes, place, strict=True) if not axis]
            parts = (self.name, *labels, *numbers, self.unit)
            yield "_".join(part for part in parts if part), values[(slice(None), *place)]


def series(run: Run) -> list[Series]:
    """Return all time series of a run, in a fixed order."""
    return [*_tick_series(run), *_certificate_series(run), *_optimum_series(run), *_timing_series(run)]


def _tick_series(run: Run) -> list[Series]:
    unit, axes = _command(run.scenario)
    layout: Table = (
        ("tick", "", lambda t: t.index, ()),
        ("time", "s", lambda t: t.time, ()),
        ("q_true", "m", lambda t: t.hand_true, (None, XY)),
        ("heading_true", "rad", lambda t: t.body_pose_true[..., 2], (None,)),
        ("body_true", "m", lambda t: t.body_pose_true[..., :2], (None, XY)),
        ("wheel_speed", "rad_s", lambda t: t.wheel_speed, (None, SIDE)),
        ("wall_margin", "m", lambda t: t.wall_margin, (None,)),
        ("wall_contact", "", lambda t: t.wall_contact, (None,)),
        ("moving_margin", "m", lambda t: t.moving_margin, (None,)),
        ("moving_contact", "", lambda t: t.moving_contact, (None,)),
        ("robot_contact", "", lambda t: t.robot_contact, (None,)),
        ("q", "m", lambda t: t.hand, (None, XY)),
        ("heading", "rad", lambda t: t.body_pose[..., 2], (None,)),
        ("body", "m", lambda t: t.body_pose[..., :2], (None, XY)),
        ("pose_frame", "", lambda t: t.pose_frame, ()),
        ("scan_frame", "", lambda t: t.scan_frame, ()),
        ("half_space_G", "", lambda t: t.half_space_G, (None, None, XY)),
        ("half_space_h", "m", lambda t: t.half_space_h, (None, None)),
        ("half_space_active", "", lambda t: t.half_space_active, (None, None)),
        ("half_space_binds", "", lambda t: t.half_space_binds, (None, None, None)),
        ("p", "m", lambda t: t.p, (None, XY)),
        ("xi", "m", lambda t: t.xi, (None, XY)),
        ("r", "m", lambda t: t.reference, (XY,)),
        ("m", "m", lambda t: t.m, (None, XY)),
        ("lambda", "", lambda t: t.multipliers, (None, None)),
        ("status", "", lambda t: t.status.astype(str), ()),
        ("rounds", "", lambda t: t.rounds, ()),
        ("sent", "bytes", lambda t: t.bytes_sent, (None,)),
        ("lost", "", lambda t: t.lost, (None,)),
        ("storage", "m2", lambda t: t.storage, ()),
        ("storage_change", "m2", lambda t: t.storage_change, ()),
        ("worst_row", "m", lambda t: t.worst_row, ()),
        ("consensus_spread", "m", lambda t: t.consensus_spread, ()),
        ("stationarity", "m", lambda t: t.stationarity, ()),
        ("complementarity", "m2", lambda t: t.complementarity, ()),
        ("u", "m_s", lambda t: t.velocity, (None, XY)),
        ("command", unit, lambda t: t.command, axes),
        ("winding_up", "", lambda t: t.winding_up, (None,)),
        ("flow_primal_storage", "m2_s2", lambda t: t.flow_primal_storage, ()),
        ("flow_dual_storage", "m2_s2", lambda t: t.flow_dual_storage, ()),
        ("flow_primal_dissipation", "m2_s3", lambda t: t.flow_primal_dissipation, ()),
        ("flow_dual_dissipation", "m2_s3", lambda t: t.flow_dual_dissipation, ()),
    )
    return _from_columns(run.ticks, [row for row in layout if row[0] not in run.absent])


def _certificate_series(run: Run) -> list[Series]:
    """Return what each certificate says of what the leaders apply, evaluated from the logged states."""
    rows = cache(lambda: per_tick(run, certificate_rows))
    index = run.ticks.index
    return [Series(f"{name}_row", "m", index, lambda k=k: rows()[:, k]) for k, name in enumerate(NAMES)]


def _command(scenario: Scenario) -> tuple[str, Axes]:
    if scenario.plant == "ideal":
        return "m_s", (None, XY)
    return {"voltage": "V", "speed_loop": "rad_s"}[scenario.drive.kind], (None, SIDE)


def _optimum_series(run: Run) -> list[Series]:
    layout: Table = (
        ("reference_tick", "", lambda o: o.index, ()),
        ("m_star", "m", lambda o: o.m, (XY,)),
        ("cost_star", "m2", lambda o: o.cost, ()),
        ("lambda_star", "", lambda o: o.multipliers, (None, None)),
        ("reference_status", "", lambda o: o.status.astype(str), ()),
        ("primal_storage", "m2", lambda o: o.primal_storage, ()),
        ("dual_storage", "m2", lambda o: o.dual_storage, ()),
        ("primal_dissipation", "m2_s", lambda o: o.primal_dissipation, ()),
        ("dual_dissipation", "m2_s", lambda o: o.dual_dissipation, ()),
    )
    return _from_columns(run.optima, layout)


def _timing_series(run: Run) -> list[Series]:
    t = run.timings
    stages = [field.name for field in fields(t) if field.name != "index"]
    layout: Table = [(f"wall_clock_{stage}", "s", attrgetter(stage), ()) for stage in stages]
    return _from_columns(t, [("timed_tick", "", attrgetter("index"), ()), *layout]) if len(t.index) else []


def _from_columns(columns: LoggedSeries, layout: Table) -> list[Series]:
    """Return series that take their values from a log's columns, each read when it is asked for and not kept."""
    return [
        Series(name, unit, columns.index, lambda of=of: of(columns.without_cache()), axes)
        for name, unit, of, axes in layout
    ]
