"""Write a scenario: many robots in physics under the rollout governor, on a random 6-regular graph with 20 % leaders.

Their formation is a grid, 0.35 m apart, ten columns wide. Three robots of the column nearest to the wall have beams;
the reference lies 1 m behind the line. Robots start 1 m off, up to 7 cm from their place in the grid.

    python scripts/rollout_team.py --robots 200 > team.yaml
    pbrg run team.yaml --set control.separation=0.22
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
import yaml
from rollout_scale import SPACING, regular_edges

COLUMNS = 10
BEST, BEYOND = 0.5, 1.0  # the best m, and how far behind it the reference lies [m]
AWAY, SCATTER = (-1.0, 0.3), 0.07  # [m]
CLEARANCE, THICKNESS = 0.1, 0.1  # [m]


def scenario_of(n: int, rng: np.random.Generator) -> dict[str, Any]:
    """Return the scenario as YAML has it; `n` is a multiple of ten."""
    rows = n // COLUMNS
    edges = regular_edges(n, rng) + 1
    leaders = np.sort(rng.permutation(n)[: n // 5] + 1)
    row, column = np.divmod(np.arange(n), COLUMNS)
    formation = SPACING * np.column_stack([column - (COLUMNS - 1) / 2, row - (rows - 1) / 2])
    start = formation + AWAY + rng.uniform(-SCATTER, SCATTER, (n, 2))
    wall = round(float(formation[:, 0].max() + BEST + CLEARANCE + THICKNESS / 2), 3)
    half = SPACING * rows / 2 + 3.0
    return {
        "timing": {"duration": 70.0},
        "team": {
            "start": start.round(3).tolist(),
            "formation": formation.round(3).tolist(),
            "leaders": leaders.tolist(),
        },
        "world": {"walls": [{"from": [wall, -half], "to": [wall, half], "thickness": THICKNESS}]},
        "sensors": {"beams": {"robots": [COLUMNS, COLUMNS * (rows // 2), n]}},
        "graph": {"kind": "edges", "edges": sorted(sorted(edge) for edge in edges.tolist())},
        "control": {"alpha_r": 2.5},
        "governor": {"kind": "rollout", "rounds": 10},
        "operator": {"reference": [BEST + BEYOND, 0.0]},
    }


def main() -> None:
    """Print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=200, help="a multiple of ten")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    print(yaml.safe_dump(scenario_of(given.robots, np.random.default_rng(given.seed)), default_flow_style=None), end="")


if __name__ == "__main__":
    main()
