"""Integrator wind-up: xi goes on growing while the wheels do not do what the pre-stabiliser says.

V = rho^2 / 2 only falls because the robots move at u. Where wheels are stuck or saturated, xi_j integrates a
disagreement that robot j does nothing about, and rho grows. Robot j sees this by itself, from its own u, p and xi. With
tau the consensus' slowest time constant, 1 / lambda_2(L), and weights e^(-s / tau) on what was s seconds ago, it sums

    wanted: the way that u told it to go,    made: the way that p went,    grown: what ||xi|| gained    [m]

and is winding up while it was told to go somewhere, made less than half of that way, and xi grew meanwhile. Half: what
it missed, which winds xi up, is then more than what it did, which unwinds it. A way counts when it is longer than
`outcome.tolerance`, the length below which the scenario calls the formation reached, and so does the growth of xi.
A robot that moves at u, as in the ideal plant, has made = wanted to the bit of rounding: it never winds up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.network import Network


@dataclass(frozen=True)
class WindUpDetector:
    """When a robot counts as winding up."""

    keep: float  # weight of what was a tick ago
    tick: float  # [s]
    length: float  # a way or a growth of this length counts [m]

    @classmethod
    def of(cls, scenario: Scenario, network: Network) -> WindUpDetector:
        """Return the rule for a scenario's team."""
        slowest = float(np.linalg.eigvalsh(network.laplacian)[:2][-1])  # lambda_2 [1/s]; 0 for a robot alone
        tick = scenario.timing.tick
        return cls(math.exp(-tick * slowest), tick, scenario.outcome.tolerance)


@dataclass(frozen=True)
class WindUpState:
    """What every robot remembers of the ways behind it."""

    p: np.ndarray  # (n, 2) at the last tick [m]
    xi: np.ndarray  # (n, 2) at the last tick [m]
    ways: np.ndarray  # (n, 5) wanted x, y, the way of the coming tick included; made x, y; grown [m]


def wind_up(
    rule: WindUpDetector, before: WindUpState | None, p: np.ndarray, xi: np.ndarray, u: np.ndarray
) -> tuple[WindUpState, np.ndarray]:
    """Return what is remembered after T ticks, and who winds up at each of them, (T, n) bool.

    `p`, `xi` (T, n, 2) [m] are the states at these ticks, `u` (T, n, 2) [m/s] what the robots do from each on; `before`
    is the memory of the tick before them, None if there is none. What is told of robot j depends on its own rows alone.
    """
    winding = np.zeros(p.shape[:2], dtype=bool)
    if before is None:  # nobody has gone any way yet
        ways, first = np.hstack([rule.tick * u[0], np.zeros((p.shape[1], 3))]), 1
        memory = (p[0], xi[0])
    else:
        ways, first = before.ways.copy(), 0
        memory = (before.p, before.xi)
    _follow(memory, (p[first:], xi[first:], u[first:]), (rule.keep, rule.tick, rule.length), ways, winding[first:])
    return WindUpState(p[-1].copy(), xi[-1].copy(), ways), winding


@kernel
def _follow(before, states, rule, ways, winding):  # pragma: no cover - compiled
    """Bring the ways to the last tick, `wanted` with the next tick's way, and write who winds up."""
    p_before, xi_before = before
    p, xi, u = states
    keep, tick, length = rule
    for t in range(len(p)):
        for j in range(len(ways)):
            along = square = 0.0
            for axis in range(2):
                wanted = keep * ways[j, axis]
                made = keep * (ways[j, 2 + axis] + (p[t, j, axis] - p_before[j, axis]))
                along += wanted * made
                square += wanted**2
                ways[j, axis], ways[j, 2 + axis] = wanted + tick * u[t, j, axis], made
            gained = math.hypot(xi[t, j, 0], xi[t, j, 1]) - math.hypot(xi_before[j, 0], xi_before[j, 1])
            grown = ways[j, 4] = keep * (ways[j, 4] + gained)
            winding[t, j] = grown > length and square > length**2 and along < 0.5 * square
        p_before, xi_before = p[t], xi[t]
