"""Measure plain and scattering exchange under delay and loss, draw docs/img/network_*.png, print the numbers as JSON.

python scripts/network          # about a minute; needs the `plot` extra
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from figures import draw
from static import FLOW, distance, plain, uneven, uniform, waves

from pbrg_mj.team.channel import Loss

IMG = Path(__file__).resolve().parents[2] / "docs" / "img"
DELAYS = (1, 10, 20, 40, 60, 70, 80, 100, 150, 200)  # rounds
IMPEDANCES = (0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 8.0)
DEFAULT = 2.0
JITTERS = (10, 40)  # rounds
SHARES = (0.1, 0.3, 0.5)  # of messages lost
WINDOW = (60.0, 240.0)  # [s] over which a rate is fitted


def rate(channel) -> float:
    """Slope of log distance over time [1/s]: negative converges."""
    times, off = distance(channel, WINDOW[1], every=100)
    usable = (times > WINDOW[0]) & (off > 3e-6) & (off < 1e50)  # the optimum itself is known to 1e-6
    if usable.sum() < 5:
        usable = (off > 3e-6) & (off < 1e50) & (times > 10.0)
    return float(np.polyfit(times[usable], np.log(off[usable]), 1)[0])


def measure() -> dict:
    """Return all measurements by name."""
    losses = {f"{share:g}, independent": Loss.independent(share) for share in SHARES}
    losses |= {f"{share:g}, in runs of 20": Loss.bursty(share, 20.0) for share in SHARES}
    at = uniform(120)
    return {
        "delay_s": [FLOW.step * d for d in DELAYS],
        "plain_per_s": [rate(plain(uniform(d))) for d in DELAYS],
        "waves_per_s": [rate(waves(uniform(d), DEFAULT)) for d in DELAYS],
        "plain_uneven_per_s": [rate(plain(uneven(d))) for d in DELAYS],
        "waves_uneven_per_s": [rate(waves(uneven(d), DEFAULT)) for d in DELAYS],
        "impedance": list(IMPEDANCES),
        "impedance_0.1_s": [rate(waves(uniform(20), eta)) for eta in IMPEDANCES],
        "impedance_0.4_s": [rate(waves(uniform(80), eta)) for eta in IMPEDANCES],
        "impedance_1_s": [rate(waves(uniform(200), eta)) for eta in IMPEDANCES],
        "run_plain_0.6_s": [list(map(float, row)) for row in distance(plain(at), 60.0)],
        "run_waves_0.6_s": [list(map(float, row)) for row in distance(waves(at, DEFAULT), 60.0)],
        "run_plain_0.3_s": [list(map(float, row)) for row in distance(plain(uniform(60)), 60.0)],
        "run_waves_0.3_s": [list(map(float, row)) for row in distance(waves(uniform(60), DEFAULT), 60.0)],
        "loss_plain_0.1_s_per_s": {name: rate(plain(uniform(20), loss)) for name, loss in losses.items()},
        "jitter_plain_0.1_s_per_s": {jitter: rate(plain(uniform(20), jitter=jitter)) for jitter in JITTERS},
        "jitter_waves_0.1_s_per_s": {jitter: rate(waves(uniform(20), DEFAULT, jitter=jitter)) for jitter in JITTERS},
        "loss_waves_without_reserve_0.1_s_per_s": {
            name: rate(replace(waves(uniform(20), DEFAULT, loss), reserve=0)) for name, loss in losses.items()
        },
        "loss_waves_0.1_s_per_s": {name: rate(waves(uniform(20), DEFAULT, loss)) for name, loss in losses.items()},
    }


def main() -> int:
    found = measure()
    draw(found, IMG)
    json.dump({name: value for name, value in found.items() if not name.startswith("run_")}, sys.stdout, indent=1)
    print()
    return 0


if __name__ == "__main__":
    sys.exit(main())
