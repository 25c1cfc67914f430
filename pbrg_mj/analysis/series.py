"""The log's time series under their public names: quantity, then unit. docs/export.md explains each."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from itertools import product

import numpy as np

from pbrg_mj.analysis.metrics.per_tick import certificate_rows, per_tick
from pbrg_mj.governor.certificate.evaluate import NAMES
from pbrg_mj.log.read.run import Run

XY = ("x", "y")
SIDE = ("left", "right")


@dataclass(frozen=True)
class Series:
    """One quantity over time: `values[s]` belongs to tick `index[s]`.

    `axes` names what the axes after the first run over: a tuple of components, or None for a count from 1.
    """

    name: str
    unit: str
    index: np.ndarray  # (S,) int64
    values: np.ndarray  # (S, ...)
    axes: tuple[tuple[str, ...] | None, ...] = ()

    @property
    def key(self) -> str:
        """Name and unit: `q_true_m`."""
        return "_".join(part for part in (self.name, self.unit) if part)

    def columns(self) -> Iterator[tuple[str, np.ndarray]]:
        """Yield every component as a flat column (S,), named like `q_true_x_1_m`: components first, then counts."""
        for place in product(*(range(size) for size in self.values.shape[1:])):
            labels = [axis[i] for axis, i in zip(self.axes, place, strict=True) if axis]
            numbers = [str(i + 1) for axis, i in zip(self.axes, place, strict=True) if not axis]
            parts = (self.name, *labels, *numbers, self.unit)
            yield "_".join(part for part in parts if part), self.values[(slice(None), *place)]


def series(run: Run) -> list[Series]:
    """Return all time series of a run, in a fixed order."""
    return [*_tick_series(run), *_certificate_series(run), *_optimum_series(run), *_timing_series(run)]


def _tick_series(run: Run) -> list[Series]:
    t = run.ticks
    layout = (
        ("tick", "", t.index, ()),
        ("time", "s", t.time, ()),
        ("q_true", "m", t.hand_true, (None, XY)),
        ("heading_true", "rad", t.body_pose_true[..., 2], (None,)),
        ("body_true", "m", t.body_pose_true[..., :2], (None, XY)),
        ("wheel_speed", "rad_s", t.wheel_speed, (None, SIDE)),
        ("wall_margin", "m", t.wall_margin, (None,)),
        ("wall_contact", "", t.wall_contact, (None,)),
        ("moving_margin", "m", t.moving_margin, (None,)),
        ("moving_contact", "", t.moving_contact, (None,)),
        ("robot_contact", "", t.robot_contact, (None,)),
        ("q", "m", t.hand, (None, XY)),
        ("heading", "rad", t.body_pose[..., 2], (None,)),
        ("body", "m", t.body_pose[..., :2], (None, XY)),
        ("pose_frame", "", t.pose_frame, ()),
        ("scan_frame", "", t.scan_frame, ()),
        ("half_space_G", "", t.half_space_G, (None, None, XY)),
        ("half_space_h", "m", t.half_space_h, (None, None)),
        ("half_space_active", "", t.half_space_active, (None, None)),
        ("half_space_binds", "", t.half_space_binds, (None, None, None)),
        ("p", "m", t.p, (None, XY)),
        ("xi", "m", t.xi, (None, XY)),
        ("r", "m", t.reference, (XY,)),
        ("m", "m", t.m, (None, XY)),
        ("lambda", "", t.multipliers, (None, None)),
        ("status", "", t.status.astype(str), ()),
        ("rounds", "", t.rounds, ()),
        ("sent", "bytes", t.bytes_sent, (None,)),
        ("lost", "", t.lost, (None,)),
        ("storage", "m2", t.storage, ()),
        ("storage_change", "m2", t.storage_change, ()),
        ("worst_row", "m", t.worst_row, ()),
        ("consensus_spread", "m", t.consensus_spread, ()),
        ("stationarity", "m", t.stationarity, ()),
        ("complementarity", "m2", t.complementarity, ()),
        ("u", "m_s", t.velocity, (None, XY)),
        ("command", *_command(run)),
        ("winding_up", "", t.winding_up, (None,)),
        ("flow_primal_storage", "m2_s2", t.flow_primal_storage, ()),
        ("flow_dual_storage", "m2_s2", t.flow_dual_storage, ()),
        ("flow_primal_dissipation", "m2_s3", t.flow_primal_dissipation, ()),
        ("flow_dual_dissipation", "m2_s3", t.flow_dual_dissipation, ()),
    )
    known = [row for row in layout if row[0] not in run.absent]
    return [Series(name, unit, t.index, values, axes) for name, unit, values, axes in known]


def _certificate_series(run: Run) -> list[Series]:
    """Return what each certificate says of what the leaders apply, evaluated from the logged states."""
    rows = per_tick(run, certificate_rows)
    return [Series(f"{name}_row", "m", run.ticks.index, rows[:, k]) for k, name in enumerate(NAMES)]


def _command(run: Run) -> tuple[str, np.ndarray, tuple[tuple[str, ...] | None, ...]]:
    if run.scenario.plant == "ideal":
        return "m_s", run.ticks.command, (None, XY)
    unit = {"voltage": "V", "speed_loop": "rad_s"}[run.scenario.drive.kind]
    return unit, run.ticks.command, (None, SIDE)


def _optimum_series(run: Run) -> list[Series]:
    o = run.optima
    layout = (
        ("reference_tick", "", o.index, ()),
        ("m_star", "m", o.m, (XY,)),
        ("cost_star", "m2", o.cost, ()),
        ("lambda_star", "", o.multipliers, (None, None)),
        ("reference_status", "", o.status.astype(str), ()),
        ("primal_storage", "m2", o.primal_storage, ()),
        ("dual_storage", "m2", o.dual_storage, ()),
        ("primal_dissipation", "m2_s", o.primal_dissipation, ()),
        ("dual_dissipation", "m2_s", o.dual_dissipation, ()),
    )
    return [Series(name, unit, o.index, values, axes) for name, unit, values, axes in layout]


def _timing_series(run: Run) -> list[Series]:
    t = run.timings
    stages = [field.name for field in fields(t) if field.name != "index"]
    wall = [Series(f"wall_clock_{stage}", "s", t.index, getattr(t, stage)) for stage in stages]
    return [Series("timed_tick", "", t.index, t.index), *wall] if len(t.index) else []
