"""Metrics of one's own: functions of a run, handed over or offered by an installed package."""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from pbrg_mj.errors import PlugInError
from pbrg_mj.plugin_calls import plug_in_errors
from pbrg_mj.plugins import METRIC, find, make

if TYPE_CHECKING:
    from pbrg_mj.api.run import Run

Metric = str | Callable[..., float | Mapping[str, float]]
"""The name of an entry point of `pbrg_mj.metrics`, or a function `metric(run)` or `metric(run, options)`."""


def evaluate_metric(run: Run, metric: Metric, options: Mapping[str, Any]) -> dict[str, float | None]:
    """Return a metric's numbers by name; units in the names, NaN and infinities are None, as in `RunMetrics.as_dict`.

    A function that returns one number gives it the metric's own name. Raises InputError for an unknown name and wrong
    options, PlugInError when the metric fails or returns anything but numbers.
    """
    name = metric_name(metric)
    value: Any = make(METRIC, name, find(METRIC, metric) if isinstance(metric, str) else metric, run, options)
    values = value if isinstance(value, Mapping) else {name: value}
    for key, number in values.items():
        if not isinstance(key, str) or not isinstance(number, numbers.Real):
            raise PlugInError(f"{name}: the metric returned {key!r}: {number!r}; allowed: a number, or numbers by name")
    with plug_in_errors("metric", name, "its numbers"):
        numbers_of = {str(key): float(number) for key, number in values.items()}
    return {key: number if math.isfinite(number) else None for key, number in numbers_of.items()}


def metric_name(metric: Metric) -> str:
    """Return what a metric is called: its entry point's name, or its function's."""
    return metric if isinstance(metric, str) else getattr(metric, "__name__", type(metric).__name__)
