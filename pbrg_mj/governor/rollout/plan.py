"""How a team is rolled out: what all robots know beforehand.

A cycle has C ticks. In its first one robots measure; then come rounds of messages:

    D        flood: the box that holds all p, the largest xi, the m that is held
    K p      the rollout: K steps of Q ticks, p rounds each, under the m that is held. With it the half-spaces go to all
             robots, at most one in a message; in the last D rounds, a message takes all that its sender has not sent
    D        verdicts: the least advance of all robots along each half-space

In its last tick the leaders move m. So the rollout begins C - 1 ticks before: these ask for nothing, ticks after do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pbrg_mj.errors import InputError
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.problem.near_reference import farthest_reference
from pbrg_mj.governor.rollout.bounds import rollout_bounds
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.channel import Channel
from pbrg_mj.team.network import Network

ACCURACY = 1e-3  # of one step, per metre of the fastest mode: sets how many ticks a step has
DECAY = 1e-2  # of the error, by which a rollout may end
FAILED_CYCLES = 0.1  # share of cycles that may still lack a message after all repeats
MOST_TICKS = 1000  # of a cycle


@dataclass(frozen=True)
class RolloutPlan:
    """A rollout of n robots."""

    gains: tuple[float, float, float]  # alpha_r [1/s], leak [-], tick [s]
    formation: np.ndarray  # (n, 2) b [m]
    margin: float  # [m]
    weights: np.ndarray  # (Q, p + 1) of a step: binomials C(r, i), r = 1 .. Q
    steps: int  # K
    error: np.ndarray  # (K Q + 1, n) bound of predicted positions per metre of ||e||
    from_start: np.ndarray  # (n,) the same of positions after the last tick
    from_hold: np.ndarray  # (n,) the same per metre that m moves
    diameter: int  # D
    cycle_ticks: int  # C
    latency: int = 0  # rounds of the network by which messages may be late
    repeats: int = 1  # how often every message is sent
    reach: float = math.inf  # of a retreat [m]
    farthest: float = math.inf  # that r may be from the mean of p [m]

    @classmethod
    def of(cls, scenario: Scenario, network: Network, margin: float, channel: Channel | None) -> RolloutPlan:
        """Return the plan of a scenario.

        Raises InputError where its rounds are too few to be ahead of time, ValueError when its team does not settle.
        """
        model, order = TeamModel.of_scenario(scenario), scenario.governor.rollout_order
        weights = step_weights(order, _step_ticks(model, order))
        latency = 0 if channel is None else int(channel.longest.max(initial=0))
        ahead, rounds, links = model.settling_ticks(DECAY), scenario.governor.rounds, len(network.neighbours)
        cycle_ticks, steps, repeats = 1, 0, 1
        while True:
            steps = -(-(cycle_ticks - 1 + ahead) // len(weights))
            steps = max(steps, -(-network.diameter // order))  # half-spaces take D rounds of the rollout
            exchanges = 2 * network.diameter + steps * order
            repeats = 1 if channel is None else _repeats(channel.loss.share, links * exchanges)
            needed = -(-exchanges * (latency + repeats) // rounds)
            if needed <= cycle_ticks:
                break
            cycle_ticks = needed
            if cycle_ticks > MOST_TICKS:
                raise InputError(
                    f"is {rounds}, by which a rollout takes more than {MOST_TICKS} ticks; allowed: more rounds",
                    key="governor.rounds",
                )
        bounds = rollout_bounds(model, weights, steps)
        return cls(
            gains=(scenario.control.alpha_r, scenario.control.leak, scenario.timing.tick),
            formation=np.array(scenario.team.formation, dtype=float),
            margin=margin,
            weights=weights,
            steps=steps,
            error=bounds.error,
            from_start=bounds.remaining[-1],
            from_hold=bounds.remaining[len(bounds.remaining) - cycle_ticks],
            diameter=network.diameter,
            cycle_ticks=cycle_ticks,
            latency=latency,
            repeats=repeats,
            reach=scenario.governor.reference_range,
            farthest=farthest_reference(scenario.plant),
        )

    @property
    def order(self) -> int:
        """Rounds of a step, p."""
        return self.weights.shape[1] - 1

    @property
    def hold(self) -> int:
        """Ticks from a cycle's first to its last."""
        return self.cycle_ticks - 1

    @property
    def exchanges(self) -> int:
        """How often in a cycle every robot hears all its neighbours."""
        return 2 * self.diameter + self.steps * self.order

    def sends_all_left(self, exchange: int) -> bool:
        """Return whether a message of the rollout takes all half-spaces not yet sent, not one: in its last D exchanges.

        That is enough: what a robot has not sent when they begin goes out at once, and what it has sent its neighbours
        have. Of W half-spaces, none is left by then if there are D + W exchanges before.
        """
        return exchange >= self.exchanges - 2 * self.diameter

    @property
    def rounds_of_an_exchange(self) -> int:
        """How many rounds of the network one takes."""
        return self.latency + self.repeats


def step_weights(order: int, ticks: int) -> np.ndarray:
    """Return the binomials C(r, i), (ticks, order + 1), for r = 1 .. ticks and i = 0 .. order."""
    return np.array([[float(math.comb(r, i)) for i in range(order + 1)] for r in range(1, ticks + 1)])


def _step_ticks(model: TeamModel, order: int) -> int:
    """Return Q: as many ticks as the first term that is cut off allows, x^(p + 1) / (p + 1)! <= `ACCURACY`.

    x is the step times the fastest mode's rate. Steps of up to p ticks are exact.
    """
    n = model.robots
    fastest = float(np.abs(np.linalg.eigvals((model.step - np.eye(2 * n)) / model.tick)).max())
    longest = (ACCURACY * math.factorial(order + 1)) ** (1.0 / (order + 1)) / fastest
    return max(order, int(longest / model.tick))


def _repeats(loss: float, messages: int) -> int:
    """Return how often messages are sent so that all of a cycle arrive in most cycles."""
    if loss in (0.0, 1.0) or not messages:
        return 1
    return max(1, math.ceil(math.log(FAILED_CYCLES / messages) / math.log(loss)))
