"""Where the paper's simulations come to rest, against the quasi-static law of docs/paper.md.

python scripts/terminal_gap.py           # long runs (some minutes), docs/data/terminal_gap.json and the figure
python scripts/terminal_gap.py --draw    # draw again from the data
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from joblib import Parallel, delayed
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import brentq

from pbrg_mj.analysis.metrics.margins import ball_radius
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.team.graph import network

DOCS = Path(__file__).resolve().parents[1] / "docs"
DATA = DOCS / "data" / "terminal_gap.json"
EVERY = 1.0  # [s] between samples
RUNS = {
    "inadmissible, exact optimum": ("inadmissible", 300.0, ("governor.kind=centralized",)),
    "inadmissible, rounds of 1 ms": ("inadmissible", 2000.0, ()),
    "inadmissible, rounds of 0.1 ms": ("inadmissible", 300.0, ("governor.rounds=100",)),
    "near, exact optimum": ("near", 300.0, ("governor.kind=centralized",)),
    "near, rounds of 1 ms": ("near", 300.0, ()),
}


@dataclass(frozen=True)
class Law:
    """The quasi-static law of one leader and one line: m = optimum of the ball problem, s = alpha_r kappa ||w||."""

    n: int
    alpha_r: float  # [1/s]
    kappa: float  # ||L^+ e_leader||

    @property
    def c(self) -> float:
        """rho / ||w||."""
        return float(np.sqrt(self.n + (self.alpha_r * self.kappa) ** 2))

    def angle(self, along: float, normal: float) -> float:
        """Return phi between w and G, where (cos phi + c/n) / sin phi = normal / along."""
        a = self.c / self.n
        return brentq(lambda phi: (np.cos(phi) + a) * along - normal * np.sin(phi), 1e-12, np.pi - 1e-12)

    def rest(self, along: float, normal: float, beyond: float) -> tuple[float, float]:
        """Return the terminal gap [m] and phi at rest of a team that is `along` and `normal` away from r [m].

        Along the way normal = K (cos phi + a) tan(phi/2)^(1/a) and along = K sin phi tan(phi/2)^(1/a); the team
        rests where normal = `beyond`, the distance of r behind the line.
        """
        a, start = self.c / self.n, self.angle(along, normal)
        K = along / (np.sin(start) * np.tan(start / 2) ** (1 / a))
        last = brentq(lambda phi: K * (np.cos(phi) + a) * np.tan(phi / 2) ** (1 / a) - beyond, 1e-9, start)
        return float(K * np.sin(last) * np.tan(last / 2) ** (1 / a)), last

    def rate(self, phi: float) -> float:
        """Return the rate [1/s] at which rho and the distance to the line decay."""
        return self.alpha_r / self.n * np.cos(phi) / (self.c + np.cos(phi))


def law() -> Law:
    scenario = load_scenario("paper/simulation_near").scenario
    net = network(scenario)
    L_plus = np.linalg.pinv(net.laplacian)
    return Law(net.robots, scenario.control.alpha_r, float(np.linalg.norm(L_plus @ net.leader)))


def simulate(which: str, duration: float, extra: tuple[str, ...]) -> dict[str, Any]:
    """Return samples of the team's mean in the line's coordinates (along it from r, before it) and of rho."""
    overrides = [f"timing.duration={duration}", "reference.solver=none", *extra]
    scenario = load_scenario(f"paper/simulation_{which}", overrides).scenario
    formation, r = np.array(scenario.team.formation), np.array(scenario.operator.reference)
    G = np.array([1.0, 1.0]) / np.sqrt(2.0)
    d = 3.0 / np.sqrt(2.0) - (formation @ G).max()
    every = round(EVERY / scenario.timing.tick)
    rows = []
    for record in Simulation.build(scenario).records():
        if record.index % every == 0:
            p, m = record.truth.hand_world - formation, record.solution.m[4]
            mean = p.mean(axis=0)
            radius = float(ball_radius(m[None], p[None], record.problem.xi[None])[0])
            along = (mean - r) @ np.array([G[1], -G[0]])
            rows.append([record.time, along, d - G @ mean, radius, np.linalg.norm(m - mean)])
    time, along, distance, radius, w = np.array(rows).T
    best = float(max(G @ r - d, 0.0))
    columns = {"time_s": time, "along_m": along, "distance_m": distance, "rho_m": radius, "w_m": w}
    return {"beyond_m": best, **{key: np.round(value, 7).tolist() for key, value in columns.items()}}


def compare(run: dict[str, Any], rule: Law) -> dict[str, Any]:
    """Return what the law says, from the state at 20 s on, beside what was measured."""
    time, along, distance, radius, w = (
        np.array(run[key]) for key in ("time_s", "along_m", "distance_m", "rho_m", "w_m")
    )
    at, decay = int(np.searchsorted(time, 20.0)), slice(*np.searchsorted(time, [60.0, 90.0]))
    beyond = run["beyond_m"]
    gap, phi = (0.0, 0.0)
    if beyond > 1e-9:
        gap, phi = rule.rest(abs(along[at]), beyond + distance[at], beyond)
    return {
        "terminal_gap_m": {
            f"at {t} s": float(np.hypot(along[t], distance[t])) for t in (60, 90, 200, 300) if t < len(time)
        },
        "terminal_gap_at_end_m": float(np.hypot(along[-1], distance[-1])),
        "along_least_and_largest_after_100_s_m": [float(along[100:].min()), float(along[100:].max())],
        "rho_largest_after_100_s_m": float(radius[100:].max()),
        "terminal_gap_law_m": gap,
        "rho_over_w_at_40_s": float(radius[40] / w[40]),
        "rho_over_w_law": rule.c,
        "rate_60_to_90_s": float(-np.polyfit(time[decay], np.log(radius[decay]), 1)[0]),
        "rate_law": rule.rate(phi),
    }


LOOK: dict[str, dict[str, Any]] = {
    "inadmissible, exact optimum": {"color": "black", "linestyle": "-"},
    "inadmissible, rounds of 1 ms": {"color": "0.6", "linestyle": "-"},
    "inadmissible, rounds of 0.1 ms": {"color": "0.3", "linestyle": "--"},
    "near, rounds of 1 ms": {"color": "black", "linestyle": ":"},
}


def draw(found: dict[str, Any], path: Path) -> None:
    with matplotlib.rc_context({"font.size": 8, "legend.fontsize": 7}):
        figure = Figure(figsize=(7.2, 3.0), layout="constrained")
        left, right = figure.subplots(1, 2)
        for name, look in LOOK.items():
            run = found["runs"][name]
            right.semilogy(run["time_s"], run["rho_m"], linewidth=1.1, label=name, **look)
            if name.startswith("inadmissible"):
                left.plot(run["along_m"], run["distance_m"], linewidth=1.1, **look)
        _law(left, found["runs"]["inadmissible, exact optimum"])
        left.set_xlim(-0.15, 0.5)
        left.set_ylim(-0.02, 0.5)
        left.axhline(0.0, color="black", linewidth=0.8)
        left.plot(0, 0, "x", color="black", label="best admissible")
        left.set_xlabel("along the line, from the best point [m]")
        left.set_ylabel("distance of the mean from the line [m]")
        right.set_xlim(0, 400)
        right.set_ylim(1e-6, 4)
        right.set_xlabel("time [s]")
        right.set_ylabel("$\\rho$ [m]")
        for axes in (left, right):
            axes.legend(loc="best")
        figure.savefig(path, dpi=150)


def _law(axes: Axes, run: dict[str, Any]) -> None:
    rule, at = law(), 20
    along, normal = abs(run["along_m"][at]), run["beyond_m"] + run["distance_m"][at]
    distance = np.linspace(run["distance_m"][at], 0.0, 30)
    path = [rule.rest(along, normal, run["beyond_m"] + one)[0] for one in distance[1:]]
    axes.plot([along, *path], distance, "+", color="black", markersize=5, label="quasi-static law, from 20 s on")


def main() -> int:
    if "--draw" not in sys.argv[1:]:
        runs = Parallel(n_jobs=2)(delayed(simulate)(*arguments) for arguments in RUNS.values())
        named = dict(zip(RUNS, runs, strict=True))
        summary = {name: compare(run, law()) for name, run in named.items()}
        DATA.parent.mkdir(exist_ok=True)
        DATA.write_text(json.dumps({"summary": summary, "runs": named}) + "\n", encoding="utf-8")
    found = json.loads(DATA.read_text(encoding="utf-8"))
    draw(found, DOCS / "img" / "terminal_gap.png")
    print(json.dumps(found["summary"], indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
