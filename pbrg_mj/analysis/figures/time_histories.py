"""Panels over time: governed references, margins, gap to the optimum, consensus, multipliers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pbrg_mj.analysis.figures.style import (
    COLOURS,
    LINES,
    OPTIMUM,
    THICK,
    THIN,
    finite,
    label,
    legend_above,
    marked_style,
)
from pbrg_mj.analysis.metrics.margins import true_margin
from pbrg_mj.analysis.metrics.per_tick import certificate_rows, least_sensed_margin, multiplier_sums, per_tick
from pbrg_mj.governor.certificate.evaluate import NAMES
from pbrg_mj.log.read.run import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BALL = NAMES.index("ball")
MOST = 1e3  # [m] what is more has diverged
LEAST = 1e-12  # [m] what is less is rounding, and has no place on a logarithmic axis


def references(component: int, axes: Axes, run: Run) -> None:
    """Draw one component of every robot's m, and of the centralized optimum on the same data."""
    m = run.ticks.m[..., component]
    _per_robot(axes, run, m, "m")
    if len(run.optima.time):
        axes.plot(run.optima.time, finite(run.optima.m[:, component]), **OPTIMUM, label="$m^*$")
    axes.set_ylabel(f"$m_{'xy'[component]}$ [m]")
    if component == 0:
        legend_above(axes)


def margin(axes: Axes, run: Run) -> None:
    """Draw the least distance to a line: true, as sensed, and what the certificate's ball leaves (-g, eq. 13)."""
    curves = {
        "true": true_margin(run.ticks, run.scenario).min(axis=1),
        "sensed": per_tick(run, least_sensed_margin),
        "certified": -per_tick(run, certificate_rows)[:, BALL],
    }
    for (name, values), line, colour in zip(curves.items(), LINES, COLOURS, strict=False):
        if np.isfinite(values).any():
            axes.plot(run.ticks.time, finite(values), linestyle=line, color=colour, linewidth=THIN, label=name)
    _scale_to(axes, curves["true"])
    axes.set_ylabel("least margin [m]")
    legend_above(axes)


def _scale_to(axes: Axes, true: np.ndarray) -> None:
    """Let the true margin set the scale: by how much a certificate fails must not hide what matters."""
    if not axes.lines:
        _write_note(axes, "no wall, no half-space")
        return
    axes.axhline(0.0, color="0.4", linewidth=0.7)
    largest = np.max(true, where=np.isfinite(true), initial=0.0)
    if largest > 0:
        axes.set_ylim(max(axes.get_ylim()[0], -1.1 * largest), 1.1 * largest)


def gap(axes: Axes, run: Run) -> None:
    """Draw how far from the centralized optimum the references are; shaded where there is none."""
    rows = np.searchsorted(run.ticks.index, run.optima.index)
    known = rows < len(run.ticks.index)  # a log cut short may hold a reference whose tick is lost
    time, optima = run.optima.time[known], run.optima.m[known]
    away = np.linalg.norm(run.ticks.m[rows[known]] - optima[:, None, :], axis=-1)
    leaders = np.array(run.scenario.team.leaders) - 1
    if len(time):
        axes.set_yscale("log")
        axes.plot(time, _positive(away.max(axis=1)), color=COLOURS[0], linewidth=THIN, label="any robot")
        furthest = _positive(away[:, leaders].max(axis=1))
        axes.plot(time, furthest, color=COLOURS[1], linestyle="--", linewidth=THICK, label="leaders")
        none = ~np.isfinite(optima).all(axis=1)
        if none.any():
            shade = {"transform": axes.get_xaxis_transform(), "step": "post", "color": "0.85", "linewidth": 0}
            axes.fill_between(time, 0.0, 1.0, where=none.tolist(), label="no optimum", **shade)
    else:
        _write_note(axes, "no centralized optimum in the log")
    axes.set_ylabel("$\\|m_i - m^*\\|$ [m]")
    legend_above(axes)


def consensus(axes: Axes, run: Run) -> None:
    """Draw the largest distance between two robots' references."""
    axes.set_yscale("log")
    spread = finite(run.ticks.consensus_spread)
    axes.plot(run.ticks.time, _positive(spread), color=COLOURS[0], linewidth=THIN)
    plotted = spread[(spread > LEAST) & (spread < MOST)]
    if len(plotted):  # what is rounding, or has diverged, must not set the scale
        axes.set_ylim(0.5 * plotted.min(), 2.0 * plotted.max())
    elif not (spread > LEAST).any():
        axes.set_ylim(LEAST / 2, 1e3 * LEAST)
    axes.set_ylabel("$\\max\\,\\|m_i - m_j\\|$ [m]")


def multipliers(axes: Axes, run: Run) -> None:
    """Draw the sum of each robot's multipliers, of all together, and of the centralized optimum's.

    Rows that are active together share a price as they like; the sums can be compared.
    """
    each = per_tick(run, multiplier_sums)
    _per_robot(axes, run, each, "\\lambda")
    axes.plot(run.ticks.time, finite(each.sum(axis=1)), color="black", linewidth=THIN, label="$\\Sigma$")
    star = finite(run.optima.multipliers.sum(axis=(1, 2)))
    if np.isfinite(star).any():
        axes.plot(run.optima.time, star, **OPTIMUM, label="$\\Sigma^*$")
        # Where the problem all but ceases to be feasible, its multipliers have no bound.
        largest = max(np.nanmax(finite(each.sum(axis=1)), initial=0.0), np.nanpercentile(star, 95))
        if largest > 0:
            axes.set_ylim(-0.05 * largest, 1.1 * largest)
    axes.set_ylabel("sum of $\\lambda$ [m]")
    legend_above(axes)


def _write_note(axes: Axes, words: str) -> None:
    axes.text(0.5, 0.5, words, transform=axes.transAxes, ha="center", va="center", color="0.4")
    axes.set_yticks([])


def _per_robot(axes: Axes, run: Run, values: np.ndarray, symbol: str) -> None:
    """Draw values (T, n), a curve per robot."""
    steps, n = values.shape
    for robot in range(n):
        style = marked_style(robot, n, steps)
        axes.plot(run.ticks.time, finite(values[:, robot]), label=label(symbol, robot, n), **style)


def _positive(values: np.ndarray) -> np.ndarray:
    return np.maximum(finite(values), LEAST)
