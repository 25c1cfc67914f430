"""The rollout's messages on the wire: at most 64 bytes for one half-space, for many one each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pytest

from pbrg_mj.governor.messaging.networked import NetworkedGovernor
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.governor.registry import governor
from pbrg_mj.governor.rollout.messages import HalfSpace, Key
from pbrg_mj.governor.rollout.plan import RolloutPlan, step_weights
from pbrg_mj.governor.rollout.robot import RolloutMemory, RolloutProgram
from pbrg_mj.governor.rollout.team import run_cycle
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.team.graph import network_of_edges
from pbrg_mj.team.network import Network

SLOTS = 6


@dataclass(frozen=True)
class Recording(RolloutProgram):
    """The robots' program, with the lengths of what every robot sends a neighbour in every round."""

    lengths: list[int] = field(default_factory=list)

    def send(self, memory: RolloutMemory) -> tuple[Mapping[int, bytes], RolloutMemory]:
        outbox, memory = super().send(memory)
        lengths = {len(content) for content in outbox.values()}
        assert len(lengths) == 1
        self.lengths.extend(lengths)
        return outbox, memory


def random_team(n: int, rng: np.random.Generator) -> Network:
    """Return a random tree with a few more edges: its diameter is not known beforehand."""
    edges = {(int(rng.integers(max(0, j - 3), j)), j) for j in range(1, n)}
    edges |= {tuple(sorted(rng.choice(n, 2, replace=False).tolist())) for _ in range(n // 4)}
    leader = np.zeros(n)
    leader[rng.integers(n)] = 1.0
    return network_of_edges(sorted(edges), leader)


def plan_of(team: Network, steps: int, order: int = 8) -> RolloutPlan:
    """Return a plan of exact steps, one tick a cycle; its bounds of the tail do not matter here."""
    n = team.robots
    return RolloutPlan(
        gains=(2.5, 0.05, 0.01),
        formation=np.random.default_rng(5).normal(size=(n, 2)),
        margin=0.01,
        weights=step_weights(order, order),
        steps=steps,
        error=np.zeros((steps * order + 1, n)),
        from_start=np.full(n, 0.01),
        from_hold=np.full(n, 0.01),
        diameter=team.diameter,
        cycle_ticks=1,
    )


def random_problem(
    team: Network, common: list[int], alone: list[int], rng: np.random.Generator
) -> tuple[Problem, dict[Key, HalfSpace]]:
    """Return a problem in which each robot of `common` sees a half-space that binds all, of `alone` one of its own."""
    n = team.robots
    spaces, found, p = HalfSpaces.empty(n, SLOTS), {}, rng.normal(size=(n, 2))
    for robot in common + alone:
        slot, binds_all = int(spaces.active[robot].sum()), len(found) < len(common)
        angle = rng.uniform(0, 2 * np.pi)
        G, h = np.array([np.cos(angle), np.sin(angle)]), float(rng.uniform(5.0, 8.0))
        spaces.G[robot, slot], spaces.h[robot, slot], spaces.active[robot, slot] = G, h, True
        spaces.binds[robot, slot] = True if binds_all else np.arange(n) == robot
        found[robot, slot] = HalfSpace(binds_all, float(G[0]), float(G[1]), h)
    rows = Rows(np.zeros((n, 1)), np.zeros((n, 1, 2)), np.zeros((n, 1)), np.zeros((n, 1), dtype=bool))
    return Problem(team, p, np.zeros((n, 2)), rows, np.array([9.0, 9.0]), spaces, np.zeros(n)), found


def lengths_of_two_cycles(
    plan: RolloutPlan, problem: Problem, half_spaces: dict[Key, HalfSpace]
) -> tuple[np.ndarray, tuple[RolloutMemory, ...]]:
    """Return the lengths (2 cycles, exchanges, n) on the wire, held to those of all robots at once, and the memories.

    The first cycle finds the step response, the second one has verdicts, held to those of all robots at once.
    """
    team, program = problem.network, Recording(plan)
    carried = NetworkedGovernor(program, plan.exchanges)
    memory, held, response, cycle, counted = carried.init(problem), np.full(2, np.nan), None, None, []
    for _ in range(2):
        cycle = run_cycle(plan, team.arrays, (problem.p, problem.xi), held, half_spaces, response)
        solution, memory = carried.step(problem, memory)
        np.testing.assert_array_equal(solution.bytes_sent, cycle.bytes_sent.sum(axis=0))
        response, held = cycle.response, cycle.summary.centre
        counted.append(cycle.bytes_sent // np.diff(team.first))
    lengths = np.array(program.lengths).reshape(2, plan.exchanges, team.robots)
    np.testing.assert_array_equal(lengths, counted)
    assert cycle is not None
    for robot in memory.robots:
        assert robot.verdicts == cycle.verdicts
    return lengths, memory.robots


@pytest.mark.parametrize("n", [5, 20])
def test_no_message_is_longer_than_64_bytes_for_one_half_space(n: int) -> None:
    rng = np.random.default_rng(n)
    for _ in range(2):
        team = random_team(n, rng)
        plan = plan_of(team, steps=6)
        lengths, _ = lengths_of_two_cycles(plan, *random_problem(team, [int(rng.integers(n))], [], rng))
        D = team.diameter
        assert lengths.max() == 61
        assert (lengths[:, :D] == 58).all()
        assert set(np.unique(lengths[:, D:-D])) == {34, 61}
        assert set(np.unique(lengths[1, -D:])) == {2, 21}


@pytest.mark.parametrize("seen_by", ["everybody", "one", "both ends of a path"])
def test_half_spaces_go_one_by_one_and_all_robots_know_all(seen_by: str) -> None:
    """D + W exchanges before the last D are enough, wherever the W half-spaces come from; so verdicts alone grow."""
    rng = np.random.default_rng(41)
    for _ in range(3):
        team, common = random_team(12, rng), rng.permutation(12).tolist()
        if seen_by == "one":
            common = [3] * SLOTS
        elif seen_by == "both ends of a path":
            team, common = network_of_edges([(i, i + 1) for i in range(11)], np.eye(12)[4]), [0, 11] * SLOTS
        D, W = team.diameter, len(common)
        plan = plan_of(team, steps=-(-(2 * D + W) // 2), order=2)
        lengths, robots = lengths_of_two_cycles(plan, *random_problem(team, common, [], rng))
        assert lengths[:, :-D].max() == 61
        assert lengths[1, -D:].max() == 2 + 19 * W
        assert all(len(robot.half_spaces) == W for robot in robots)


def test_what_is_left_goes_in_the_last_exchanges_of_the_rollout() -> None:
    rng = np.random.default_rng(42)
    for _ in range(4):
        team = random_team(12, rng)
        common = np.repeat(rng.permutation(12), 3).tolist()
        plan = plan_of(team, steps=-(-team.diameter // 4), order=4)
        assert plan.steps * plan.order < team.diameter + 4
        lengths, robots = lengths_of_two_cycles(plan, *random_problem(team, common, [], rng))
        assert lengths[:, team.diameter : -team.diameter].max() > 61
        assert all(len(robot.half_spaces) == len(common) for robot in robots)


def test_a_verdict_on_a_half_space_that_others_do_not_know_contains_its_normal() -> None:
    """2 bytes, 19 of the half-space of all, 35 of each of the two that robot 3 alone knows."""
    rng = np.random.default_rng(43)
    team = random_team(9, rng)
    lengths, _ = lengths_of_two_cycles(plan_of(team, steps=6), *random_problem(team, [2], [2, 2], rng))
    assert lengths[1].max() == 2 + 19 + 2 * 35


def test_half_spaces_have_the_rounds_to_reach_all_robots(monkeypatch: pytest.MonkeyPatch) -> None:
    """However soon a team settles: here it need not settle at all."""
    monkeypatch.setattr("pbrg_mj.governor.rollout.plan.DECAY", 1e3)
    start = [[0.5 * i, 0.0] for i in range(20)]
    team = [f"team.start={start}", f"team.formation={start}", "graph.kind=path", "control.alpha_r=2.5"]
    keys = ["governor.kind=rollout", "governor.rollout_order=1", "reference.solver=none", *team]
    plan = governor(load_scenario("paper/simulation_inadmissible", keys).scenario).plan
    assert plan.steps * plan.order >= plan.diameter == 19
