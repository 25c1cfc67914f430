"""A run as an `xarray.Dataset`: named dimensions, coordinates, units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pbrg_mj.analysis.series import SIDE, XY, Series, series
from pbrg_mj.errors import InputError
from pbrg_mj.log.read.run import Run

if TYPE_CHECKING:
    import xarray

# What the counted axes of a series run over, where it is not the robots alone.
COUNTS = {
    "half_space_G": ("robot", "slot"),
    "half_space_h": ("robot", "slot"),
    "half_space_active": ("robot", "slot"),
    "half_space_binds": ("robot", "slot", "bound_robot"),
    "lambda": ("robot", "row"),
    "lambda_star": ("robot", "row"),
}
COMPONENTS = {XY: "xy", SIDE: "side"}
NUMBERED = ("robot", "slot", "bound_robot", "row")  # counted from 1, as in the export's columns
UNITS = {"": "1", "m2": "m2", "m_s": "m/s", "rad_s": "rad/s", "m2_s": "m2/s", "m2_s2": "m2/s2", "m2_s3": "m2/s3"}


def dataset(run: Run) -> xarray.Dataset:
    """Return all series of a run under the export's names, each with its unit as the attribute `units`.

    Dimensions: `tick`, and `reference_tick` for the centralized optimum, numbered as in the log and with their times
    [s] beside them; `robot`, `slot` of a half-space, `row` of a constraint, `bound_robot`, counted from 1; `xy` and
    `side` by name. Raises InputError when xarray is not installed.
    """
    try:
        import xarray
    except ImportError as error:
        raise InputError("this needs xarray: pip install xarray") from error
    indices = ("tick", "reference_tick", "timed_tick")
    found = {one.key: _variable(run, one) for one in series(run) if one.key not in indices}
    sizes = {name: size for dims, values, _ in found.values() for name, size in zip(dims, values.shape, strict=True)}
    coordinates: dict[str, Any] = {name: np.arange(1, sizes[name] + 1) for name in NUMBERED if name in sizes}
    coordinates |= {name: list(labels) for labels, name in COMPONENTS.items() if name in sizes}
    coordinates |= {"tick": run.ticks.index, "reference_tick": run.optima.index, "time_s": found.pop("time_s")}
    coordinates["reference_time_s"] = (("reference_tick",), run.optima.time, {"units": "s"})
    constants = {
        "formation_m": (("robot", "xy"), np.array(run.scenario.team.formation, dtype=float), {"units": "m"}),
        "leaders": (("leader",), np.array(run.scenario.team.leaders), {"units": "1"}),
    }
    about = {"scenario_name": run.name, "scenario_yaml": run.scenario_yaml}
    return xarray.Dataset(found | constants, coordinates, about)


def _variable(run: Run, one: Series) -> tuple[tuple[str, ...], np.ndarray, dict[str, str]]:
    """Return dimensions, values and attributes."""
    over = "reference_tick" if one.index is run.optima.index else "tick"
    counts = iter(COUNTS.get(one.name, ("robot",)))
    dims = tuple(next(counts) if axis is None else COMPONENTS[axis] for axis in one.axes)
    values, units = one.values, {"units": UNITS.get(one.unit, one.unit)}
    if one.index is run.timings.index and len(values) != len(run.ticks.index):
        values = _in_rows(values, one.index, run.ticks.index)
    return (over, *dims), values, units


def _in_rows(values: np.ndarray, index: np.ndarray, ticks: np.ndarray) -> np.ndarray:
    """Return the values (S,) at all ticks: NaN where a log cut short lacks one."""
    full = np.full(len(ticks), np.nan)
    known = np.isin(index, ticks)
    full[np.searchsorted(ticks, index[known])] = values[known]
    return full
