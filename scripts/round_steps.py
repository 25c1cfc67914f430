"""At how many random optima rounds of some lengths are unstable: the tables of docs/theory.md.

python -m scripts.round_steps 600 [--seed 7]    # 0.15 s each

The optima, and the round linearised at each, are those of tests/test_governor_stability.py and
tests/test_governor_proximal.py.
"""

from __future__ import annotations

import argparse

import numpy as np

from pbrg_mj.governor.problem.rows import rho
from pbrg_mj.governor.stability.linear_step import linear_step_limit, max_gradient_norms
from tests.linear_rounds import longest_step, modes_at, proximal_factors_at, spectral_radius
from tests.test_governor_proximal import bound
from tests.test_governor_stability import random_feasible

ROUNDING = 1e-9  # of a factor


def steps_at(rng: np.random.Generator) -> dict[str, float | bool]:
    """Return what holds at one random optimum."""
    static, optimum, formation, alpha = random_feasible(rng)
    limit = linear_step_limit(static.network, alpha, max_gradient_norms(static.network, formation, None))
    bend = rho(optimum.m, static.p, static.xi)
    kappa = alpha * static.network.robots * float(optimum.multipliers.sum()) / bend
    true, proximal = longest_step(modes_at(static, optimum, alpha)), bound(static, alpha)

    def rings(share: float) -> bool:
        return spectral_radius(proximal_factors_at(static, optimum, alpha, share * proximal)) > 1.0 + ROUNDING

    return {
        "explicit, 0.98 of linear_step_limit": true < 0.98 * limit,
        "of them with h kappa < 1": true < 0.98 * limit and limit * kappa < 1.0,
        "all with h kappa < 1": limit * kappa < 1.0,
        "explicit, 0.25 of linear_step_limit": true < 0.25 * limit,
        "explicit, 0.98 / (1 / linear_step_limit + kappa)": true < 0.98 / (1.0 / limit + kappa),
        "explicit, 0.98 of the proximal bound": true < 0.98 * proximal,
        "proximal, 0.98 of the bound": rings(0.98),
        "proximal, 0.5 of the bound": rings(0.5),
        "proximal, twice the bound": rings(2.0),
        "the proximal bound is longer than linear_step_limit": proximal > limit,
        "by a factor of": proximal / limit,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("optima", type=int)
    parser.add_argument("--seed", type=int, default=7)
    asked = parser.parse_args()
    rng = np.random.default_rng(asked.seed)
    found = [steps_at(rng) for _ in range(asked.optima)]
    for name in found[0]:
        values = np.array([one[name] for one in found])
        text = f"{values.sum()} of {len(values)}" if values.dtype == bool else f"{np.exp(np.log(values).mean()):.2f}"
        print(f"{name:<55}{text}")


if __name__ == "__main__":
    main()
