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
class WindUpRule:
    """When a robot counts as winding up."""

    keep: float  # weight of what was a tick ago
    tick: float  # [s]
    length: float  # a way or a growth of this length counts [m]

    @classmethod
    def of(cls, scenario: Scenario, network: Network) -> WindUpRule:
        """Return the rule for a scenario's team."""
        slowest = float(np.linalg.eigvalsh(network.laplacian)[:2][-1])  # lambda_2 [1/s]; 0 for a robot alone
        tick = scenario.timing.tick
        return cls(math.exp(-tick * slowest), tick, scenario.outcome.tolerance)


@dataclass(frozen=True)
class WindUp:
    """What every robot remembers of the ways behind it, and who is winding up."""

    p: np.ndarray  # (n, 2) at this tick [m]
    xi: np.ndarray  # (n, 2) at this tick [m]
    ways: np.ndarray  # (n, 5) wanted x, y, the way of the coming tick included; made x, y; grown [m]
    winding: np.ndarray  # (n,) bool


def wind_up(rule: WindUpRule, before: WindUp | None, p: np.ndarray, xi: np.ndarray, u: np.ndarray) -> WindUp:
    """Return who winds up at this tick; `before` is the tick before, None in the first.

    `p`, `xi` (n, 2) [m] are the states at this tick, `u` (n, 2) [m/s] what the robots do from here on. Row j depends on
    rows j alone.
    """
    if before is None:
        return WindUp(p, xi, np.hstack([rule.tick * u, np.zeros((len(p), 3))]), np.zeros(len(p), dtype=bool))
    memory = (before.p, before.xi, before.ways)
    return WindUp(p, xi, *_followed(memory, (p, xi, u), (rule.keep, rule.tick, rule.length)))


@kernel
def _followed(memory, state, rule):  # pragma: no cover - compiled
    """Return the ways a tick later, `wanted` with the next tick's way, and who winds up."""
    p_before, xi_before, before = memory
    p, xi, u = state
    keep, tick, length = rule
    ways, winding = np.empty(before.shape), np.empty(len(before), dtype=np.bool_)
    for j in range(len(before)):
        along = square = 0.0
        for axis in range(2):
            wanted = keep * before[j, axis]
            made = keep * (before[j, 2 + axis] + (p[j, axis] - p_before[j, axis]))
            along += wanted * made
            square += wanted**2
            ways[j, axis], ways[j, 2 + axis] = wanted + tick * u[j, axis], made
        gained = math.hypot(xi[j, 0], xi[j, 1]) - math.hypot(xi_before[j, 0], xi_before[j, 1])
        grown = ways[j, 4] = keep * (before[j, 4] + gained)
        winding[j] = grown > length and square > length**2 and along < 0.5 * square
    return ways, winding
