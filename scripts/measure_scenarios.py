"""Run bundled scenarios in full, each with its own seed, and write the tables of docs/scenarios.md.

python scripts/measure_scenarios.py [--jobs N] [--logs DIR] [NAME ...]    # DIR keeps the logs

With names only these are run, and the page keeps the rows of the others.
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

from pbrg_mj.analysis.metrics.contacts import FIELDS, contact_flags, words
from pbrg_mj.analysis.metrics.outcome import final_target
from pbrg_mj.analysis.metrics.run_metrics import RunMetrics, metrics
from pbrg_mj.log.read.run import Run, open_run
from pbrg_mj.log.write.writer import LogWriter
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.bundled import bundled_scenarios
from pbrg_mj.scenario.load import load_scenario

PAGE = Path(__file__).resolve().parents[1] / "docs" / "scenarios.md"
FLOORS = ("floor/friction_patches", "floor/even_floor", "floor/frictionless")


@dataclass(frozen=True)
class Measured:
    """One scenario's run."""

    name: str
    description: str
    numbers: RunMetrics
    contact: str
    static_error: np.ndarray | None  # (n,) [m]


def measure(name: str, folder: Path) -> Measured:
    """Run a bundled scenario into a log, and measure it from there."""
    loaded = load_scenario(name, ["log.timings=false"])
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
    return f"robot {robot + 1} with {words(run, kind, tick, robot)} at {run.ticks.time[tick]:.1f} s"


def static_error(run: Run) -> np.ndarray | None:
    """Return ||q_j - b_j - target|| (n,) [m], averaged over the last `outcome.rest_time`; None without a target."""
    point = final_target(run).point
    if point is None:
        return None
    late = run.ticks.time >= run.ticks.time[-1] - run.scenario.outcome.rest_time
    shifted = run.ticks.hand_true[late] - np.array(run.scenario.team.formation)
    return np.linalg.norm(shifted - point, axis=-1).mean(axis=0)


def outcomes(found: list[Measured], before: dict[str, str]) -> Iterator[str]:
    """Yield the lines of the table of all scenarios; of those that were not run the row that stood there `before`."""
    yield (
        "| scenario | shows | outcome | first contact | least true margin [m] | terminal gap [m] "
        "| least gap between robots [m] | reference infeasible | largest xi [m] | binds at the end |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|"
    rows = before | dict(measured_rows(found))
    yield from (rows[name] for name in bundled_scenarios() if name in rows)


def measured_rows(found: list[Measured]) -> Iterator[tuple[str, str]]:
    """Yield each scenario's name and row of the table."""
    for one in found:
        n = one.numbers
        numbers = (n.true_margin_min_m, n.terminal_gap_m, n.robot_gap_min_m, n.reference_infeasible_share, n.xi_max_m)
        outcome = f"{n.outcome}: {n.reason}" if n.reason else n.outcome
        binds = "; ".join(n.binding) or "-"
        cells = (f"`{one.name}`", one.description, outcome, one.contact, *map(number, numbers), binds)
        yield one.name, "| " + " | ".join(cells) + " |"


def rows_of(page: str) -> dict[str, str]:
    """Return the rows of the page's table of all scenarios by name."""
    table = page.partition("<!-- outcomes -->")[2].partition("<!-- end of outcomes -->")[0]
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
    options.add_argument("--jobs", type=int, default=2, help="runs at the same time")
    options.add_argument("--logs", type=Path, help="folder that keeps the logs")
    given = options.parse_args()
    with tempfile.TemporaryDirectory() as scratch, ProcessPoolExecutor(given.jobs) as pool:
        folder = given.logs or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        found = list(pool.map(measure, given.names or bundled_scenarios(), repeat(folder)))
    page = PAGE.read_text(encoding="utf-8")
    page = between(page, "outcomes", outcomes(found, rows_of(page) if given.names else {}))
    if {one.name for one in found} >= set(FLOORS):
        page = between(page, "floors", floors(found))
    PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
