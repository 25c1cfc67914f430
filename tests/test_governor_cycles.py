"""Certified cycles of several ticks: all robots at once against every robot's program, bit for bit, byte for byte."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.governor.certificate.directional_ball import DirectionalBall
from pbrg_mj.governor.certificate.prediction_grid import PredictionGrid
from pbrg_mj.governor.certificate.predictive import PredictiveCertificate
from pbrg_mj.governor.certificate.sight import SightLimit
from pbrg_mj.governor.certificate.speed import SpeedLimit, disc_facets
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.certified.compiled import CompiledDecision
from pbrg_mj.governor.certified.cycles import CycleGovernor
from pbrg_mj.governor.certified.robot import CertifiedProgram
from pbrg_mj.governor.messaging.networked import NetworkedGovernor
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.governor.registry import governor
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.schema import Control
from pbrg_mj.team.graph import network_of_edges
from pbrg_mj.team.network import Network

TICKS = 50


def ring(n: int, *leaders: int) -> Network:
    return network_of_edges([(i, (i + 1) % n) for i in range(n)], np.isin(np.arange(n), leaders).astype(float))


def line(n: int, *leaders: int) -> Network:
    return network_of_edges([(i, i + 1) for i in range(n - 1)], np.isin(np.arange(n), leaders).astype(float))


CASES = [  # team, rounds a tick, ticks a cycle, longer than two floods or just as long
    (ring(5, 4), 1, 4),
    (ring(6, 0), 2, 3),
    (ring(7, 2, 5), 4, 2),
    (ring(9, 3), 3, 4),
    (ring(12, 1), 5, 3),
    (line(5, 0), 3, 3),
    (line(6, 3), 1, 10),
    (line(4, 0, 3), 2, 3),
    (line(2, 1), 1, 2),
]


@pytest.mark.parametrize(("team", "rounds", "cycle_ticks"), CASES)
@pytest.mark.parametrize("predictive", [True, False], ids=["predictive", "directional ball"])
def test_cycles_of_several_ticks_at_once_are_the_robots_programs(
    team: Network, rounds: int, cycle_ticks: int, predictive: bool
) -> None:
    """In a team that moves among half-spaces that come and go, beyond some of them at times."""
    n, rng = team.robots, np.random.default_rng(10 * team.robots + rounds)
    model, formation = TeamModel.of(team, Control(alpha_r=1.0), 0.05), rng.normal(size=(n, 2))
    grid = PredictionGrid.of(model, 0.1)
    certificate = (
        PredictiveCertificate(grid, formation, 0.0) if predictive else DirectionalBall(formation, model.growth, 0.0)
    )
    limits = (SpeedLimit.of(model, grid, disc_facets(2.0, 6), 0.1), SightLimit.of(grid, np.array([0]), 1.0))
    program = CertifiedProgram(team, certificate, model, limits, np.inf, cycle_ticks, 1, farthest=2.0)
    carried = NetworkedGovernor(program, rounds)
    at_once = CycleGovernor(team, model, CompiledDecision.of(certificate, limits, np.inf, 2.0), rounds, cycle_ticks)
    p, xi, spaces = 0.3 * rng.normal(size=(n, 2)), np.zeros((n, 2)), HalfSpaces.empty(n, 2)
    ours = theirs = None
    statuses, heading = set(), rng.uniform(-np.pi, np.pi, size=n)
    for tick in range(TICKS):
        if tick % 3 == 0:
            spaces = changed(rng, spaces, formation, tick)
        rows = Rows(np.zeros((n, 4)), np.zeros((n, 4, 2)), np.zeros((n, 4)), np.zeros((n, 4), dtype=bool))
        problem = Problem(team, p, xi, rows, 3.0 * rng.normal(size=2), spaces, heading)
        ours = at_once.init(problem) if ours is None else ours
        theirs = carried.init(problem) if theirs is None else theirs
        one, ours = at_once.step(problem, ours)
        other, theirs = carried.step(problem, theirs)
        np.testing.assert_array_equal(one.m, other.m)
        np.testing.assert_array_equal(one.bytes_sent, other.bytes_sent)
        assert (one.status, one.rounds) == (other.status, other.rounds)
        statuses.add(one.status)
        p, xi = model.predicted(p, xi, one.m[team.leader > 0][0], 1)
        heading = heading + 0.1 * rng.normal(size=n)
    assert statuses >= {"holding", "ok"}


def changed(rng: np.random.Generator, before: HalfSpaces, formation: np.ndarray, tick: int) -> HalfSpaces:
    """Return half-spaces of which some robots' are others than before."""
    n, slots = before.h.shape
    spaces, angle = HalfSpaces.empty(n, slots), rng.uniform(-np.pi, np.pi, size=(n, slots))
    spaces.active[:] = rng.random((n, slots)) < 1.5 / n
    spaces.G[spaces.active] = np.stack([np.cos(angle), np.sin(angle)], axis=-1)[spaces.active]
    spaces.binds[spaces.active] = rng.random((n, slots, n))[spaces.active] < 0.5
    room = rng.uniform(-0.2, 2.0, size=(n, slots))
    spaces.h[:] = np.where(spaces.active, np.max(spaces.G @ formation.T, axis=2) + room, 0.0)
    kept = rng.random(n) < 0.5
    for name in ("G", "h", "active", "binds"):
        getattr(spaces, name)[kept] = getattr(before, name)[kept]
    return spaces


def test_large_teams_run_at_once() -> None:
    keys = ["governor.kind=certified", "reference.solver=none"]
    chosen = governor(load_scenario("scale/twenty_robots", keys).scenario)
    assert isinstance(chosen, CycleGovernor)
    late = governor(load_scenario("scale/twenty_robots", [*keys, "network.delay_rounds=1"]).scenario)
    assert isinstance(late, NetworkedGovernor)
