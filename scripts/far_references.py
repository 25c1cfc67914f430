"""How often a far reference takes the paper's team across its line on the way to the optimum: docs/theory.md.

python scripts/far_references.py 40 [--seed 5] [--kind certified]    # a second each; ideal plant
python scripts/far_references.py 40 --faster 100                     # 100 times the rounds in a tick, 10 s each

Random graphs, leaders, alpha_r of 0.1 to 6 and references 2 to 42 m away, beyond the line that robot 5 knows.
"""

from __future__ import annotations

import argparse
from itertools import combinations

import numpy as np

from pbrg_mj.loop.response_warnings import MAX_RATIO, scenario_ratio
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.schema import Scenario

NORMAL, OFFSET = np.array([1.0, 1.0]) / np.sqrt(2.0), 3.0 / np.sqrt(2.0)  # of the line
ROUNDING = 1e-6  # [m]
ROUNDS, STEP = 10, 0.001  # of the paper's simulation: in a tick, [s]


def random_team(rng: np.random.Generator, kind: str, faster: int = 1, farther: float = 1.0) -> Scenario:
    """Return the paper's simulation with another graph, leaders, alpha_r and r, and `faster` times its rounds.

    r is 2 to 30 m away along either axis, times `farther`.
    """
    path = [[k, k + 1] for k in range(1, 5)]
    links = [list(pair) for pair in combinations(range(1, 6), 2)]
    more = [links[k] for k in rng.choice(10, 3, replace=False)]
    edges = [path, [*path, [1, 5]], [*path, *(one for one in more if one not in path)], links][rng.integers(4)]
    leaders = sorted((1 + rng.permutation(5)[: rng.integers(1, 6)]).tolist())
    changes = (
        f"governor.kind={kind}",
        f"governor.rounds={ROUNDS * faster}",
        f"governor.step={STEP}",
        "reference.solver=none",
        "timing.duration=30",
        f"graph={{kind: edges, edges: {edges}}}",
        f"team.leaders={leaders}",
        f"control.alpha_r={np.exp(rng.uniform(np.log(0.1), np.log(6.0)))}",
        f"operator.reference={(farther * rng.uniform(2.0, 30.0, 2)).tolist()}",
    )
    return load_scenario("paper/simulation_inadmissible", changes).scenario


def least_margin(scenario: Scenario) -> float:
    """Return the least distance [m] of a robot from the line."""
    ticks = Simulation.build(scenario).control_ticks()
    return min(OFFSET - float((tick.hand_world @ NORMAL).max()) for tick in ticks)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("teams", type=int)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--kind", default="distributed")
    parser.add_argument("--faster", type=int, default=1, help="how many times the paper's rounds in a tick")
    asked = parser.parse_args()
    rng, found = np.random.default_rng(asked.seed), []
    for _ in range(asked.teams):
        scenario = random_team(rng, asked.kind, asked.faster)
        found.append((scenario_ratio(scenario), len(scenario.team.leaders), least_margin(scenario)))
        print("ratio {:8.3g}  leaders {}  least margin {:9.3f} m".format(*found[-1]), flush=True)
    for name, some in (
        (f"up to {MAX_RATIO:g}", [one for one in found if one[0] <= MAX_RATIO]),
        ("above", [one for one in found if one[0] > MAX_RATIO]),
    ):
        crossed = sum(margin < -ROUNDING for *_, margin in some)
        worst = min((margin for *_, margin in some), default=np.inf)
        print(f"ratio {name}: {crossed} of {len(some)} crossed, {worst:.2f} m at worst")


if __name__ == "__main__":
    main()
