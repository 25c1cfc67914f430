"""Integrator wind-up: xi goes on growing while the wheels do not do what the pre-stabiliser says.

V = rho^2 / 2 only falls because the robots move at u. Where wheels are stuck or saturated, xi_j integrates a
disagreement that robot j does nothing about, and rho grows. Robot j sees this by itself, from its own u, p and xi. With
tau the consensus' slowest time constant, 1 / lambda_2(L), and weights e^(-s / tau) on what was s seconds ago, it sums

    commanded: the displacement by u,    achieved: that of p,    growth: of ||xi||    [m]

and has integrator wind-up while it was commanded to move, achieved less than half of that, and xi grew. Half: what it
missed, which winds xi up, is then more than what it did, which unwinds it. A displacement counts when it is longer than
`outcome.tolerance`, the length below which the scenario calls the formation reached, and so does the growth of xi.
A robot that moves at u, as in the ideal plant, has achieved = commanded to the bit of rounding: it never has wind-up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.network import Network


def slowest_rate(network: Network) -> float:
    """Return lambda_2(L) [1/s], the inverse of the consensus' slowest time constant; 0 for a robot alone."""
    return float(np.linalg.eigvalsh(network.laplacian)[:2][-1])


@dataclass(frozen=True)
class WindUpDetector:
    """Parameters of the test for wind-up."""

    keep: float  # weight of what was a tick ago
    tick: float  # [s]
    length: float  # a displacement or a growth of this length counts [m]

    @classmethod
    def of(cls, scenario: Scenario, network: Network) -> WindUpDetector:
        """Return the detector for a scenario's team."""
        tick = scenario.timing.tick
        return cls(math.exp(-tick * slowest_rate(network)), tick, scenario.outcome.tolerance)


@dataclass(frozen=True)
class WindUpState:
    """What every robot remembers of its displacements."""

    p: np.ndarray  # (n, 2) at the last tick [m]
    xi: np.ndarray  # (n, 2) at the last tick [m]
    sums: np.ndarray  # (n, 5) commanded x, y, the coming tick included; achieved x, y; growth [m]


def wind_up(
    detector: WindUpDetector, before: WindUpState | None, p: np.ndarray, xi: np.ndarray, u: np.ndarray
) -> tuple[WindUpState, np.ndarray]:
    """Return what is remembered after T ticks, and which robots have wind-up at each of them, (T, n) bool.

    `p`, `xi` (T, n, 2) [m] are the states at these ticks, `u` (T, n, 2) [m/s] what the robots do from each on; `before`
    is the memory of the tick before them, None if there is none. The answer for robot j depends on its own rows alone.
    """
    winding = np.zeros(p.shape[:2], dtype=bool)
    if before is None:  # nobody has moved yet
        sums, first = np.hstack([detector.tick * u[0], np.zeros((p.shape[1], 3))]), 1
        memory = (p[0], xi[0])
    else:
        sums, first = before.sums.copy(), 0
        memory = (before.p, before.xi)
    _follow(
        memory,
        (p[first:], xi[first:], u[first:]),
        (detector.keep, detector.tick, detector.length),
        sums,
        winding[first:],
    )
    return WindUpState(p[-1].copy(), xi[-1].copy(), sums), winding


@kernel
def _follow(before, states, detector, sums, winding):
    """Bring the sums to the last tick, `commanded` with the next tick included, and write which robots have wind-up.

    `before` are p_before, xi_before (n, 2) [m] of the tick before; `states` p, xi (T, n, 2) [m] and u (T, n, 2) [m/s];
    `detector` is keep, by which sums fade in a tick, tick [s] and length [m]; sums (n, 5) [m], winding (T, n) bool.
    """
    p_before, xi_before = before
    p, xi, u = states
    keep, tick, length = detector
    for t in range(len(p)):
        for j in range(len(sums)):
            along = square = 0.0
            for axis in range(2):
                commanded = keep * sums[j, axis]
                achieved = keep * (sums[j, 2 + axis] + (p[t, j, axis] - p_before[j, axis]))
                along += commanded * achieved
                square += commanded**2
                sums[j, axis], sums[j, 2 + axis] = commanded + tick * u[t, j, axis], achieved
            gained = math.hypot(xi[t, j, 0], xi[t, j, 1]) - math.hypot(xi_before[j, 0], xi_before[j, 1])
            growth = sums[j, 4] = keep * (sums[j, 4] + gained)
            winding[t, j] = growth > length and square > length**2 and along < 0.5 * square
        p_before, xi_before = p[t], xi[t]
