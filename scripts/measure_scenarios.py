"""Run bundled scenarios in full, each with its own seed, and write the tables of docs/scenarios.md.

python scripts/measure_scenarios.py [--recommended] [--jobs N] [--logs DIR] [NAME ...]    # DIR keeps the logs

With names only these are run, and the page keeps the rows of the others. `--recommended` runs them with the set-up
that we recommend instead of their own, for the page's table of that.
"""

from __future__ import annotations

import argparse
import re
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import repeat
from pathlib import Path

import numpy as np

from pbrg_mj.analysis.metrics.contacts import FIELDS, contact_flags, contact_text
from pbrg_mj.analysis.metrics.outcome import final_target
from pbrg_mj.analysis.metrics.run_metrics import RunMetrics, metrics
from pbrg_mj.log.read.run import Run, open_run
from pbrg_mj.log.write.writer import LogWriter
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.bundled import bundled_scenarios
from pbrg_mj.scenario.load import load_scenario

PAGE = Path(__file__).resolve().parents[1] / "docs" / "scenarios.md"
RECOMMENDED = ("set_up=recommended",)
FLOORS = ("floor/friction_patches", "floor/even_floor", "floor/frictionless")


@dataclass(frozen=True)
class Measured:
    """One scenario's run."""

    name: str
    description: str
    numbers: RunMetrics
    contact: str
    static_error: np.ndarray | None  # (n,) [m]


def measure(name: str, folder: Path, recommended: bool) -> Measured:
    """Run a bundled scenario into a log, and measure it from there."""
    loaded = load_scenario(name, ["log.timings=false", *(RECOMMENDED if recommended else ())])
    path = folder / f"{name.replace('/', '-')}.mcap"
    simulation = Simulation.build(loaded.scenario)
    with LogWriter(path, loaded, simulation.model_xml, force=True) as write:
        for record in simulation.records():
            write(record)
    run = open_run(path)
    return Measured(name, loaded.scenario.description, metrics(run), contact(run), static_error(run))


def contact(run: Run) -> str:
    """Say which robot first touched what, and when; `none` if no robot did."""
    found = [(*np.argwhere(flags)[0], kind) for kind in FIELDS if (flags := contact_flags(run, kind)).any()]
    if not found:
        return "none"
    tick, robot, kind = min(found)
    return f"robot {robot + 1} with {contact_text(run, kind, tick, robot)} at {run.ticks.time[tick]:.1f} s"


def static_error(run: Run) -> np.ndarray | None:
    """Return ||q_j - b_j - target|| (n,) [m], averaged over the last `outcome.rest_time`; None without a target."""
    point = final_target(run).point
    if point is None:
        return None
    late = run.ticks.time >= run.ticks.time[-1] - run.scenario.outcome.rest_time
    shifted = run.ticks.hand_true[late] - np.array(run.scenario.team.formation)
    return np.linalg.norm(shifted - point, axis=-1).mean(axis=0)


def outcomes(rows: dict[str, str]) -> Iterator[str]:
    """Yield the lines of the table of all scenarios, of those that have a row."""
    yield (
        "| scenario | shows | outcome | first contact | least true margin [m] | terminal gap [m] "
        "| least gap between robots [m] | reference infeasible | largest xi [m] | binds at the end |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|"
    yield from (rows[name] for name in bundled_scenarios() if name in rows)


def row_of_outcomes(one: Measured) -> str:
    """Return a scenario's row of that table."""
    n = one.numbers
    numbers = (n.true_margin_min_m, n.terminal_gap_m, n.robot_gap_min_m, n.reference_infeasible_share, n.xi_max_m)
    return row(one.name, one.description, outcome(n), one.contact, *map(number, numbers), "; ".join(n.binding) or "-")


def recommended(rows: dict[str, str]) -> Iterator[str]:
    """Yield the lines of the table of the recommended set-up, likewise."""
    yield (
        "| scenario | outcome | settled after [s] | terminal gap [m] | least true margin [m] "
        "| least gap between robots [m] | binds at the end |"
    )
    yield "|---|---|---|---|---|---|---|"
    yield from (rows[name] for name in bundled_scenarios() if name in rows)


def row_of_recommended(one: Measured) -> str:
    """Return a scenario's row of that table."""
    n = one.numbers
    settled = f"{n.settling_time_s:.1f}" if np.isfinite(n.settling_time_s) else "-"
    numbers = (n.terminal_gap_m, n.true_margin_min_m, n.robot_gap_min_m)
    return row(one.name, outcome(n), settled, *map(number, numbers), "; ".join(n.binding) or "-")


def outcome(numbers: RunMetrics) -> str:
    """Return the outcome's word and what belongs to it."""
    return f"{numbers.outcome}: {numbers.reason}" if numbers.reason else numbers.outcome


def row(name: str, *cells: str) -> str:
    """Return a row of a table."""
    return "| " + " | ".join((f"`{name}`", *cells)) + " |"


def rows_of(page: str, mark: str) -> dict[str, str]:
    """Return the rows of a table of all scenarios by name."""
    table = page.partition(f"<!-- {mark} -->")[2].partition(f"<!-- end of {mark} -->")[0]
    return {line.split("`")[1]: line for line in table.splitlines() if line.startswith("| `")}


def floors(found: list[Measured]) -> Iterator[str]:
    """Yield the lines of the table of static errors."""
    runs = {one.name: one for one in found if one.name in FLOORS}
    robots = range(1, max(one.numbers.robots for one in runs.values()) + 1)
    yield "| static error [mm] | " + " | ".join(f"robot {j}" for j in robots) + " |"
    yield "|---" * (len(robots) + 1) + "|"
    for name in FLOORS:
        error = runs[name].static_error
        assert error is not None, f"{name} has no target"
        yield f"| `{name}` | " + " | ".join(f"{1e3 * value:.1f}" for value in error) + " |"


def number(value: float) -> str:
    """Return two significant digits, without exponents; `-` where there is no number."""
    if not np.isfinite(value):
        return "-"
    return "0" if abs(value) < 5e-4 else f"{value:.3f}" if abs(value) < 0.1 else f"{value:.2f}"


def between(page: str, mark: str, lines: Iterator[str]) -> str:
    """Return the page with `lines` between the marks `<!-- mark -->` and `<!-- end of mark -->`."""
    table = f"<!-- {mark} -->\n\n" + "\n".join(lines) + f"\n\n<!-- end of {mark} -->"
    replaced, count = re.subn(f"<!-- {mark} -->.*?<!-- end of {mark} -->", lambda _: table, page, flags=re.DOTALL)
    if count != 1:
        raise SystemExit(f"{PAGE}: the marks of {mark} stand there {count} times; needed: once")
    return replaced


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    options.add_argument("names", nargs="*", metavar="NAME", help="scenarios to run; none: all")
    options.add_argument("--recommended", action="store_true", help="with the set-up that we recommend")
    options.add_argument("--jobs", type=int, default=2, help="runs at the same time")
    options.add_argument("--logs", type=Path, help="folder that keeps the logs")
    given = options.parse_args()
    with tempfile.TemporaryDirectory() as scratch, ProcessPoolExecutor(given.jobs) as pool:
        folder = given.logs or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        found = []
        for one in pool.map(measure, given.names or bundled_scenarios(), repeat(folder), repeat(given.recommended)):
            found.append(one)
            write_row(one, given.recommended)
    if not given.recommended and {one.name for one in found} >= set(FLOORS):
        page = between(PAGE.read_text(encoding="utf-8"), "floors", floors(found))
        PAGE.write_text(page, encoding="utf-8")


def write_row(one: Measured, with_recommended: bool) -> None:
    """Put a run into its table of the page."""
    page, mark = PAGE.read_text(encoding="utf-8"), "recommended" if with_recommended else "outcomes"
    new = row_of_recommended(one) if with_recommended else row_of_outcomes(one)
    rows = rows_of(page, mark) | {one.name: new}
    lines = recommended(rows) if with_recommended else outcomes(rows)
    PAGE.write_text(between(page, mark, lines), encoding="utf-8")


if __name__ == "__main__":
    main()
