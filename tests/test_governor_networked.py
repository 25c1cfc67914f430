"""A robot's program on every robot, and the carrier of its messages."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import pytest

from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.certified.robot import LOST_ITEM_SHARE, CertifiedProgram, repeats_for
from pbrg_mj.governor.messaging.networked import NetworkedGovernor
from pbrg_mj.governor.messaging.program import OwnData, RobotAnswer, RobotFacts
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.registry import certificate, governor
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.channel import Loss
from pbrg_mj.team.graph import network, network_of_edges
from tests.two_governors import answers


def certified(name: str, *overrides: str) -> Scenario:
    keys = ["governor.kind=certified", "reference.solver=none", *overrides]
    return load_scenario(name, keys).scenario


def program_of(scenario: Scenario, cycle_ticks: int = 1, repeats: int = 1) -> CertifiedProgram:
    compiled = governor(scenario)
    model = TeamModel.of_scenario(scenario)
    return CertifiedProgram(
        network(scenario), certificate(scenario), model, compiled.limits, compiled.reach, cycle_ticks, repeats
    )


@pytest.mark.parametrize("name", ["obstacles/corner", "team/two_leaders"])
def test_the_compiled_governor_is_the_robots_program_bit_for_bit(name: str) -> None:
    scenario = certified(name, "timing.duration=1.5")
    compiled, carried = governor(scenario), NetworkedGovernor(program_of(scenario), scenario.governor.rounds)
    leaders = np.array(scenario.team.leaders) - 1
    for one, other in answers(scenario, compiled, carried):
        np.testing.assert_array_equal(one.m[leaders], other.m[leaders])
        np.testing.assert_array_equal(one.bytes_sent, other.bytes_sent)
        assert one.status == other.status


@dataclasses.dataclass(frozen=True)
class Gossip:
    """Every robot tells how often it has heard of anybody's secret."""

    def start(self, facts: RobotFacts, own: OwnData) -> tuple[RobotFacts, float]:
        return facts, float(own.p[0])

    def begin(self, own: OwnData, memory: tuple[RobotFacts, float]) -> tuple[RobotFacts, float]:
        return memory

    def send(self, memory: tuple[RobotFacts, float]) -> tuple[dict[int, bytes], tuple[RobotFacts, float]]:
        return dict.fromkeys(memory[0].neighbours, np.float64(memory[1]).tobytes()), memory

    def receive(self, inbox: Sequence[tuple[int, bytes]], memory: tuple[RobotFacts, float]) -> tuple[RobotFacts, float]:
        return memory[0], max([memory[1], *(float(np.frombuffer(content)[0]) for _, content in inbox)])

    def finish(self, memory: tuple[RobotFacts, float]) -> tuple[RobotAnswer, tuple[RobotFacts, float]]:
        return RobotAnswer(np.full(2, memory[1]), "ok"), memory


def path_problem(n: int) -> Problem:
    team = network_of_edges([(i, i + 1) for i in range(n - 1)], np.eye(n)[0])
    p = np.zeros((n, 2))
    p[0] = 1.0  # the secret
    spaces = HalfSpaces.empty(n, 1)
    rows = governor_rows(n)
    return Problem(team, p, np.zeros((n, 2)), rows, np.zeros(2), spaces, np.zeros(n))


def governor_rows(n: int):
    from pbrg_mj.governor.problem.rows import Rows

    return Rows(np.zeros((n, 1)), np.zeros((n, 1, 2)), np.zeros((n, 1)), np.zeros((n, 1), dtype=bool))


@pytest.mark.parametrize("rounds", [1, 3])
def test_a_private_number_travels_one_link_a_round_and_bytes_are_counted(rounds: int) -> None:
    problem, carried = path_problem(6), NetworkedGovernor(Gossip(), rounds)
    memory = carried.init(problem)
    for tick in range(1, 4):
        solution, memory = carried.step(problem, memory)
        np.testing.assert_array_equal(solution.m[:, 0], np.arange(6) <= rounds * tick)
        np.testing.assert_array_equal(solution.bytes_sent, 8 * rounds * np.array([1, 2, 2, 2, 2, 1]))


def test_a_message_to_no_neighbour_is_an_error() -> None:
    class Loud(Gossip):
        def send(self, memory):
            return {5: b"here"}, memory

    problem = path_problem(6)
    carried = NetworkedGovernor(Loud(), 1)
    with pytest.raises(ValueError, match="robot 1 sends to robot 6, which is no neighbour"):
        carried.step(problem, carried.init(problem))


def crossing(scenario: Scenario) -> tuple[float, float, set[str]]:
    """Run the ideal plant; return by how much anybody crosses, the gap of m to the optimum, and the statuses."""
    formation = np.array(scenario.team.formation)
    worst, statuses, tick = -np.inf, set(), None
    for tick in Simulation.build(scenario).control_ticks():
        spaces = tick.half_spaces
        q = tick.problem.p + formation
        values = np.where(spaces.binds, spaces.G @ q.T - spaces.h[:, :, None], -np.inf)
        worst = max(worst, float(values.max()))
        if tick.time >= 2.0:  # before the first cycle's end there is nothing to apply
            statuses.add(tick.solution.status)
    leader = scenario.team.leaders[0] - 1
    best = np.array([1.0, 2.0])  # nearest to r = (2, 3) with x + y <= 3 for robots at b up to (0, 0)
    return worst, float(np.linalg.norm(tick.solution.m[leader] - best)), statuses


@pytest.mark.parametrize(
    "network_keys",
    [
        ["network.delay_rounds=25"],
        ["network.delay_rounds=3", "network.jitter_rounds=20"],
        ["network.loss=0.5", "network.delay_rounds=2"],
        ["network.loss=0.5", "network.loss_burst=20"],
        ["network.loss=0.9"],
        ["network.outages=[{robot: 2, time: 3.0, duration: 4.0}]"],
    ],
)
def test_no_delay_and_no_loss_makes_anybody_cross(network_keys: list[str]) -> None:
    """Though another robot than the leader sees the wall."""
    keys = ["estimator.given.0.robot=2", "seed=23", "timing.duration=15.0", *network_keys]
    worst, gap, statuses = crossing(certified("paper/simulation_inadmissible", *keys))
    assert worst <= 1e-9
    assert gap < 0.3
    assert statuses <= {"ok", "holding"}
    assert "holding" in statuses or not any("outages" in key for key in network_keys)


def test_where_everything_is_lost_everybody_stays() -> None:
    scenario = certified("paper/simulation_inadmissible", "network.loss=1.0", "timing.duration=3.0")
    worst, gap, statuses = crossing(scenario)
    assert worst < 0.0
    assert gap > 1.0
    assert statuses == {"holding"}


@pytest.mark.parametrize("loss", [Loss.independent(0.3), Loss.bursty(0.5, 20.0), Loss.bursty(0.02, 3.0)])
def test_an_item_is_repeated_until_few_links_have_lost_it(loss: Loss) -> None:
    """In a long record of one link, every so many messages in a row at least one arrives, but for a few times."""
    rng, bad = np.random.default_rng(24), False
    lost = np.empty(200_000, dtype=bool)
    for message in range(len(lost)):
        bad = rng.random() < (loss.stay if bad else loss.enter)
        lost[message] = bad

    def all_lost(repeats: int) -> float:
        return float(np.lib.stride_tricks.sliding_window_view(lost, repeats).all(axis=1).mean())

    repeats = repeats_for(loss.share, loss.stay)
    assert all_lost(repeats) < 1.2 * LOST_ITEM_SHARE
    assert all_lost(repeats - 1) > 0.8 * LOST_ITEM_SHARE
