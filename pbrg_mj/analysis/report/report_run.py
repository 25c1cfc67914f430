"""What a page keeps of one run, so that many logs can be read one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbrg_mj.analysis.events import events
from pbrg_mj.analysis.metrics.log_metrics import log_metrics
from pbrg_mj.analysis.metrics.per_tick import largest_multipliers, state_size
from pbrg_mj.analysis.metrics.run_metrics import RunMetrics, metrics
from pbrg_mj.analysis.reduced_run import open_reduced
from pbrg_mj.analysis.report import scene
from pbrg_mj.analysis.report.encode import packed
from pbrg_mj.analysis.report.frames import frame_ticks, indicators, states
from pbrg_mj.analysis.report.half_space_changes import MOST_CHANGES, half_space_changes
from pbrg_mj.log.read.run import Run
from pbrg_mj.scenario.robots import robot_size
from pbrg_mj.text import plain


@dataclass(frozen=True)
class ReportRun:
    """One run on the page."""

    log: str  # the file's name, without folders
    numbers: RunMetrics
    animation: dict[str, Any]  # plain data for the page's script
    scenario_yaml: str
    versions: dict[str, str]


def report_run(run: Run, runs: int) -> ReportRun:
    """Return what a page of `runs` runs shows of this one. Raises InputError when the log holds no tick."""
    return _shown(run, runs, metrics(run), run)


def report_log(path: str | Path, runs: int) -> ReportRun:
    """Return the same of a log, which is read twice and never held. Raises what `open_run` raises."""
    run, end = open_reduced(path, (state_size, largest_multipliers), half_spaces=True)
    return _shown(run, runs, log_metrics(path), end)


def _shown(run: Run, runs: int, numbers: RunMetrics, end: Run) -> ReportRun:
    frames = frame_ticks(run, runs)
    seen = states(run, frames)
    return ReportRun(
        log=Path(run.path).name,
        numbers=numbers,
        animation=_animation(run, seen, end) | _over_time(run, frames, seen, runs) | {"outcome": numbers.outcome},
        scenario_yaml=run.scenario_yaml,
        versions=run.versions,
    )


def _animation(run: Run, seen: dict[str, Any], end: Run) -> dict[str, Any]:
    return {
        "name": plain(run.name),
        "log": plain(Path(run.path).name),
        "robots": run.scenario.robots,
        "leaders": list(run.scenario.team.leaders),
        "radius": robot_size(run.scenario.robot).body_radius if run.scenario.plant == "physics" else 0.0,
        "slots": run.ticks.half_space_h.shape[2],
        "still": scene.still(run),
        "lines": scene.lines(run),
        "target": scene.target(run),
        "extent": scene.extent(run, seen),
        "events": [event.as_dict() | {"text": plain(event.text)} for event in events(run, end)],
    }


def _over_time(run: Run, frames: Any, seen: dict[str, Any], runs: int) -> dict[str, Any]:
    sizes, centres = scene.moving(run, seen["time"])
    changes = half_space_changes(run, frames, MOST_CHANGES // runs)
    columns = {**seen, **indicators(run, frames), "movers": centres}
    return {
        "columns": {name: packed(values) for name, values in columns.items()},
        "moverSizes": sizes,
        "changes": packed(changes.table()),
    }
