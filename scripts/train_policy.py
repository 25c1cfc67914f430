"""Train a small policy by the cross-entropy method, on one core: the worked example of docs/learn.md.

    python scripts/train_policy.py            # prints the curve
    python scripts/train_policy.py --write    # and writes docs/data/policy.json and docs/img/policy.png

Every robot has the same policy: its velocity is a sum of what it observes, with a gain for each. Worlds differ in
starts, formations and references; those it is measured in are none of those it was trained in.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

import pbrg_mj as pbrg
from pbrg_mj.environments import TeamParallelEnv, parallel_env

TOP = Path(__file__).resolve().parents[1]
FAMILY = {
    "plant": "ideal",
    "timing": {"duration": 8.0, "tick": 0.05},
    "estimator": {"source": "given"},
    "team": {"leaders": [1]},
    "control": {"separation": 0.3},
    "governor": {"kind": "none"},
    "reference": {"solver": "none"},
    "draw": {
        "team": {"robots": 5, "start_radius": 1.0, "formation_radius": 0.8},
        "reference": {"distance": {"uniform": [1.0, 2.5]}, "direction_deg": {"uniform": [-180, 180]}},
    },
}
SPEED = 1.0  # [m/s] of an action of 1
TERMS = ("goal", "neighbours' p", "neighbours' xi")
EQ_2 = np.array([1.0, 1.0, -1.0])  # the paper's gains, with alpha_r = 1
TRAINED_IN, MEASURED_IN = range(1, 4), range(1001, 1021)
ITERATIONS, CANDIDATES, ELITE = 10, 16, 4


def environment() -> TeamParallelEnv:
    """Return robots that choose their velocities."""
    return parallel_env(pbrg.load(FAMILY), actions="velocities", speed=SPEED)


def action(gains: np.ndarray, seen: np.ndarray, parts: dict[str, slice]) -> np.ndarray:
    """Return what a robot with these gains does."""
    p, xi = np.split(seen[parts["neighbours"]].reshape(-1, 4).sum(axis=0), 2)
    return gains @ np.stack([seen[parts["goal"]], p, xi]) / SPEED


def episode_return(env: TeamParallelEnv, gains: np.ndarray, seed: int) -> float:
    """Return the sum of rewards of an episode, the mean of all robots."""
    total, (observed, _) = 0.0, env.reset(seed=seed)
    while env.agents:
        observed, rewards, *_ = env.step({one: action(gains, seen, env.layout.parts) for one, seen in observed.items()})
        total += float(np.mean(list(rewards.values())))
    return total


def trained(env: TeamParallelEnv, iterations: int = ITERATIONS, seed: int = 1) -> list[dict[str, Any]]:
    """Return the mean gains of every iteration of the cross-entropy method, with what candidates and elite earned."""
    random, curve = np.random.default_rng(seed), []
    mean, spread = np.zeros(len(TERMS)), np.full(len(TERMS), 1.5)
    for _ in range(iterations):
        candidates = mean + spread * random.standard_normal((CANDIDATES, len(TERMS)))
        earned = np.array([np.mean([episode_return(env, one, k) for k in TRAINED_IN]) for one in candidates])
        elite = candidates[np.argsort(earned)[-ELITE:]]
        curve.append({"gains": mean.tolist(), "median": float(np.median(earned)), "best": float(earned.max())})
        mean, spread = elite.mean(axis=0), elite.std(axis=0) + 0.05
    return [*curve, {"gains": mean.tolist()}]


def measured(env: TeamParallelEnv, gains: np.ndarray) -> list[float]:
    """Return what these gains earn in the worlds for measuring."""
    return [episode_return(env, gains, seed) for seed in MEASURED_IN]


def main() -> int:
    options = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    options.add_argument("--write", action="store_true", help="write docs/data/policy.json and docs/img/policy.png")
    write = options.parse_args().write
    env = environment()
    curve = trained(env)
    for k, one in enumerate(curve[:-1]):
        print(f"{k + 1:3d}  median {one['median']:8.2f}  best {one['best']:8.2f}")
    learned = np.array(curve[-1]["gains"])
    found = {"nothing": np.zeros(len(TERMS)), "eq. 2": EQ_2, "learned": learned}
    held_out = {name: measured(env, gains) for name, gains in found.items()}
    print("gains:", ", ".join(f"{name} {gain:.2f}" for name, gain in zip(TERMS, learned, strict=True)))
    for name, earned in held_out.items():
        print(f"{name:8}  median of {len(earned)} other worlds {np.median(earned):8.2f}")
    if write:
        text = json.dumps({"curve": curve, "held_out": held_out}, indent=1)
        (TOP / "docs/data/policy.json").write_text(text + "\n", encoding="utf-8")
        _figure(curve, {name: float(np.median(held_out[name])) for name in held_out})
    return 0


def _figure(curve: list[dict[str, Any]], held_out: dict[str, float]) -> None:
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 3.2), layout="constrained")
    rounds = np.arange(1, len(curve))
    axes.plot(rounds, [one["best"] for one in curve[:-1]], "o-", label=f"best of {CANDIDATES} candidates")
    axes.plot(rounds, [one["median"] for one in curve[:-1]], "s-", label="their median")
    for name, style in (("nothing", ":"), ("eq. 2", "--"), ("learned", "-")):
        axes.axhline(held_out[name], color="black", linestyle=style, linewidth=0.8, label=f"{name}, other worlds")
    axes.set_ylim(1.5 * held_out["nothing"], 0.0)
    axes.set_xlabel("iteration")
    axes.set_ylabel("return [m s]")
    axes.legend(fontsize="small", loc="lower right")
    figure.savefig(TOP / "docs/img/policy.png", dpi=150, metadata={"Software": None})


if __name__ == "__main__":
    sys.exit(main())
