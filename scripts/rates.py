"""Sweep the governor's rate and its rounds per tick; write docs/data/rates.json and the figures of docs/rates.md.

python scripts/rates.py              # run everything (some minutes on two cores), then draw
python scripts/rates.py --draw       # draw again from docs/data/rates.json
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from joblib import Parallel, delayed
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pbrg_mj.analysis.metrics.run_metrics import metrics
from pbrg_mj.governor.stability.linear_step import linear_step_limit, max_gradient_norms
from pbrg_mj.log.read.run import open_run
from pbrg_mj.log.write.writer import LogWriter
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.team.graph import network

DOCS = Path(__file__).resolve().parents[1] / "docs"
DATA = DOCS / "data" / "rates.json"
DURATION = 30.0  # [s]
SPEEDS = (1, 2, 4, 8, 16, 64)  # rounds of STEP in a tick of 10 ms: the flow from 1/8 to 8 times real time
STEP = 0.00125  # [s]
ROUNDS = {0.01: (1, 2, 5, 10, 20), 0.05: (2, 4, 6, 10, 25)}  # by tick [s]; rounds x step = tick
IDEAL = ("plant=ideal", "estimator.source=given", "estimator.given=[{robot: 5, normal: [1, 1], offset: 3}]")
KEEP = ("outcome", "true_margin_min_m", "optimality_gap_m", "certificate_violated_share", "governor_not_ok_share")


@dataclass(frozen=True)
class Case:
    """One point of a sweep: both of the paper's experiments are run for it."""

    sweep: str
    plant: str
    alpha_r: float  # [1/s]
    tick: float  # [s]
    rounds: int
    step: float  # [s]

    def overrides(self) -> list[str]:
        """Return what it changes in the experiments."""
        keys = {
            "log.timings": "false",
            "timing.duration": DURATION,
            "timing.tick": self.tick,
            "control.alpha_r": self.alpha_r,
            "governor.rounds": self.rounds,
            "governor.step": self.step,
        }
        return [*(IDEAL if self.plant == "ideal" else ()), *(f"{key}={value}" for key, value in keys.items())]


def cases() -> list[Case]:
    rates = [
        Case("rate", plant, alpha_r, 0.01, rounds, STEP)
        for plant in ("ideal", "physics")
        for alpha_r in (2.5, 10.0)
        for rounds in SPEEDS
    ]
    rounds = [
        Case("rounds", plant, 2.5, tick, rounds, tick / rounds)
        for plant in ("ideal", "physics")
        for tick, several in ROUNDS.items()
        for rounds in several
    ]
    return rates + rounds


def measure(case: Case) -> dict[str, Any]:
    """Safety and optimality come from the inadmissible reference, the settling time from the near one."""
    hard, easy = (simulated(f"paper/experiment_{name}", case) for name in ("inadmissible", "near"))
    found = {key: hard[key] for key in KEEP}
    found |= {"settling_time_s": easy["settling_time_s"], "near_outcome": easy["outcome"]}
    speed = case.rounds * case.step / case.tick
    rates = {"flow_speed": speed, "flow_per_time_constant_s": speed / case.alpha_r}
    sent = {"sent_per_robot_per_second_bytes": hard["sent_per_robot_per_second_bytes"]}
    return {**case.__dict__, **rates, **sent, **found}


def simulated(name: str, case: Case) -> dict[str, Any]:
    loaded = load_scenario(name, case.overrides())
    simulation = Simulation.build(loaded.scenario)
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "run.mcap"
        with LogWriter(log, loaded, simulation.model_xml) as write:
            for record in simulation.records():
                write(record)
        return metrics(open_run(log)).as_dict()


def limit() -> float:
    """Return the predicted largest step of a round [s] for the experiments."""
    scenario = load_scenario("paper/experiment_near").scenario
    team = network(scenario)
    gradients = max_gradient_norms(team, np.array(scenario.team.formation), None)
    return linear_step_limit(team, scenario.governor.alpha, gradients)


LOOK: dict[tuple[str, float], dict[str, Any]] = {
    ("ideal", 0): {"color": "black", "marker": "o", "linestyle": "-"},
    ("ideal", 1): {"color": "black", "marker": "o", "linestyle": ":", "markerfacecolor": "white"},
    ("physics", 0): {"color": "0.55", "marker": "s", "linestyle": "-"},
    ("physics", 1): {"color": "0.55", "marker": "s", "linestyle": ":", "markerfacecolor": "white"},
}
PANELS = (
    ("true_margin_min_m", "worst true margin [m]"),
    ("optimality_gap_m", "optimality gap [m]\nmean; p95 thin"),
    ("certificate_violated_share", "certificate violated,\nshare of time"),
    ("settling_time_s", "settling time [s]"),
)


def draw(rows: list[dict[str, Any]], sweep: str, x: str, by: str, path: Path) -> None:
    """One curve for every plant and value of `by`; filled markers for its smaller value."""
    rows = [row for row in rows if row["sweep"] == sweep]
    values = sorted({row[by] for row in rows})
    names = {"alpha_r": "$\\alpha_r$ = {:g} 1/s", "tick": "tick {:g} s"}
    with matplotlib.rc_context({"font.size": 8, "legend.fontsize": 7, "svg.hashsalt": "pbrg-mj"}):
        figure = Figure(figsize=(7.2, 4.6), layout="constrained")
        panels = figure.subplots(2, 2, sharex=True)
        for (plant, which), look in LOOK.items():
            chosen = [row for row in rows if row["plant"] == plant and row[by] == values[int(which)]]
            for axes, (key, _) in zip(panels.flat, PANELS, strict=True):
                curve(axes, chosen, x, key, look | {"label": f"{plant}, {names[by].format(values[int(which)])}"})
        for axes, (key, label) in zip(panels.flat, PANELS, strict=True):
            finish(axes, key, label, sweep)
        figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
        panels[1, 0].set_xlabel(XLABEL[sweep])
        panels[1, 1].set_xlabel(XLABEL[sweep])
        figure.savefig(path, dpi=150)


XLABEL = {
    "rate": "flow time per time constant of the leader, R [s]",
    "rounds": "sent per robot [kB/s]",
}


def curve(axes: Axes, rows: list[dict[str, Any]], x: str, key: str, look: dict[str, Any]) -> None:
    scale = 1e-3 if x.endswith("_bytes") else 1.0
    across = [row[x] * scale for row in rows]
    axes.plot(across, [number(row[key], "mean") for row in rows], markersize=4, linewidth=1.1, **look)
    if key == "optimality_gap_m":
        thin = {"color": look["color"], "linestyle": look["linestyle"], "linewidth": 0.6}
        axes.plot(across, [number(row[key], "p95") for row in rows], **thin)


def number(value: Any, part: str) -> float:
    value = value[part] if isinstance(value, dict) else value
    return math.nan if value is None else value


def finish(axes: Axes, key: str, label: str, sweep: str) -> None:
    axes.set_xscale("log")
    axes.set_ylabel(label)
    if key == "optimality_gap_m":
        axes.set_yscale("log")
    if key == "true_margin_min_m":
        axes.axhline(0.0, color="black", linewidth=0.6)
    if key == "settling_time_s":
        axes.set_ylim(0.0, DURATION)
    if key == "certificate_violated_share":
        axes.set_ylim(0.0, 1.0)
    if sweep == "rounds":
        axes.axvline(0.704 / limit(), color="black", linewidth=0.8, linestyle="--")  # 704 bytes a round


def main() -> int:
    if "--draw" not in sys.argv[1:]:
        rows = list(Parallel(n_jobs=2, verbose=5)(delayed(measure)(case) for case in cases()))
        DATA.parent.mkdir(exist_ok=True)
        found = {"duration_s": DURATION, "linear_step_limit_s": limit(), "points": rows}
        DATA.write_text(json.dumps(found, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    rows = json.loads(DATA.read_text(encoding="utf-8"))["points"]
    draw(rows, "rate", "flow_per_time_constant_s", "alpha_r", DOCS / "img" / "rates_governor.png")
    draw(rows, "rounds", "sent_per_robot_per_second_bytes", "tick", DOCS / "img" / "rates_rounds.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
