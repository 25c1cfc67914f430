"""Every optimizer against the optimum, and its synchronizer against delays and losses."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.certificate.ball import BallAtState
from pbrg_mj.governor.certificate.scalar_reference_governor import Spread
from pbrg_mj.governor.messaging.program import OwnData, RobotFacts
from pbrg_mj.governor.optimizers.admm import Admm
from pbrg_mj.governor.optimizers.flow_in_m import FlowInM
from pbrg_mj.governor.optimizers.interface import LocalProblem, Optimizer, no_rows
from pbrg_mj.governor.optimizers.nids import Nids
from pbrg_mj.governor.optimizers.scalar import Scalar
from pbrg_mj.governor.optimizers.synchronizer import Synchronizer
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.team.network import Network
from scripts.agreement.linear_rate import nids_rate
from scripts.agreement.moving import certified
from scripts.agreement.static import BEST, GRAPHS, facts, rounds_to_agree
from tests.problems import FORMATION, graph, half_spaces

STIFFEST = {name: float(np.linalg.eigvalsh(static().network.laplacian)[-1]) for name, static in GRAPHS.items()}


@pytest.mark.parametrize(("name", "most"), [("ring of 5", 40), ("ring of 20", 80)])
def test_the_fast_optimizers_agree_within_so_many_rounds(name: str, most: int) -> None:
    """With the scenario's default parameters, cold, and another robot than the leader knows the line."""
    static = GRAPHS[name]()
    assert not static.network.leader[static.owner]
    for optimizer in (Nids(0.5, 1.0 / STIFFEST[name]), Admm(0.5)):
        rounds = rounds_to_agree(optimizer, static, 200)
        assert rounds is not None
        assert rounds <= most


@pytest.mark.parametrize(("step", "mixing"), [(0.5, 1.0), (0.7, 0.85)])
def test_nids_comes_to_the_optimum_at_its_linear_rate(step: float, mixing: float) -> None:
    static, optimizer = GRAPHS["ring of 5"](), Nids(step, mixing / STIFFEST["ring of 5"])
    team, far = static.network, []
    locals_ = [static.local(i) for i in range(team.robots)]
    memories = [optimizer.start(facts(team, i), locals_[i]) for i in range(team.robots)]
    for _ in range(81):
        far.append(np.linalg.norm(optimizer.candidate(locals_[4], memories[4]) - BEST))
        messages = np.array([optimizer.message(memory) for memory in memories])
        received = [messages[team.neighbours[team.first[i] : team.first[i + 1]]] for i in range(team.robots)]
        memories = [optimizer.step_once(*one) for one in zip(locals_, memories, received, strict=True)]
    slope = np.polyfit(np.arange(20, 81), np.log(far[20:]), 1)[0]
    assert np.exp(slope) == pytest.approx(nids_rate(team, static.owner, step, optimizer.weight), rel=0.01)


def test_the_defaults_of_nids_have_the_least_linear_rate_on_the_ring_of_5() -> None:
    static, stiffest = GRAPHS["ring of 5"](), STIFFEST["ring of 5"]
    grid = [(step, mixing) for step in np.arange(0.05, 1.0, 0.05) for mixing in np.arange(0.1, 1.01, 0.1)]
    best = min(grid, key=lambda one: nids_rate(static.network, static.owner, one[0], one[1] / stiffest))
    assert best == pytest.approx((0.5, 1.0))


def locals_of(problem: Problem, certificate: BallAtState) -> list[LocalProblem]:
    spaces, team, found = problem.half_spaces, problem.network, []
    assert spaces is not None
    rows = certificate.rows_at(spaces, problem.p, problem.xi, problem.p.mean(axis=0))
    for i in range(team.robots):
        r = problem.reference if team.leader[i] else None
        own = OwnData(0, problem.p[i], problem.xi[i], 0.0, HalfSpaces.empty(1, 1), r)
        mine = Rows(rows.a[i : i + 1], rows.C[i : i + 1], rows.d[i : i + 1], rows.active[i : i + 1])
        found.append(LocalProblem(own, r, mine, Spread.of(problem.p, problem.xi)))
    return found


def random_ball_problem(rng: np.random.Generator, team: Network) -> tuple[Problem, list[LocalProblem]]:
    """Two walls of different robots and the ball's rows, which are cones in m."""
    angle = rng.uniform(0, 2 * np.pi)
    normals = [[np.cos(a), np.sin(a)] for a in (angle, angle + rng.uniform(0.5, 2.0))]
    walls = [(k, normal, 3.0) for k, normal in zip(rng.choice(4, 2, replace=False), normals, strict=True)]
    spaces = half_spaces(walls)
    certificate = BallAtState(FORMATION, 1.0, 0.0, None)
    p, xi = 0.1 * rng.normal(size=(5, 2)), 0.05 * rng.normal(size=(5, 2))
    rows = certificate.rows_at(spaces, p, xi, np.zeros(2))
    problem = Problem(team, p, xi, rows, 4.0 * np.array(normals).mean(axis=0), spaces)
    return problem, locals_of(problem, certificate)


@pytest.mark.parametrize(
    ("optimizer", "rounds", "problems"),
    [(Nids(0.5, 0.25), 400, 4), (Admm(0.5), 400, 4), (FlowInM(0.04, 1.0, 1.0), 2000, 2)],
)
def test_every_optimizer_finds_the_cone_programs_optimum(optimizer: Optimizer, rounds: int, problems: int) -> None:
    rng, team, solver = np.random.default_rng(51), graph(leaders=(2, 4)), ClarabelSolver()
    for _ in range(problems):
        problem, known = random_ball_problem(rng, team)
        best = solver.solve(problem)
        assert best.status == "solved"
        memories = [optimizer.start(facts(team, i), known[i]) for i in range(5)]
        for _ in range(rounds):
            messages = np.array([optimizer.message(memory) for memory in memories])
            received = [messages[team.neighbours[team.first[i] : team.first[i + 1]]] for i in range(5)]
            memories = [optimizer.step_once(*one) for one in zip(known, memories, received, strict=True)]
        for local, memory in zip(known, memories, strict=True):
            np.testing.assert_allclose(optimizer.candidate(local, memory), best.m, atol=2e-4)


@pytest.mark.parametrize("lossy", [False, True])
def test_delays_and_losses_change_when_and_not_what_is_computed(lossy: bool) -> None:
    """Every robot goes through the iterates of the network without delays, one by one."""
    rng, team, optimizer = np.random.default_rng(52), graph(), Nids(0.5, 0.25)
    _, known = random_ball_problem(rng, team)
    in_time, late = Synchronizer(optimizer, lossy=False), Synchronizer(optimizer, lossy=lossy)
    expected, at = [], [in_time.start(facts(team, i), known[i]) for i in range(5)]
    for _ in range(30):
        expected.append([one.present for one in at])
        sent = [in_time.send(one)[0] for one in at]
        at = [in_time.receive([(k, sent[k]) for k in one.facts.neighbours], known[i], one) for i, one in enumerate(at)]
    at = [late.start(facts(team, i), known[i]) for i in range(5)]
    now = 0
    under_way: list[tuple[int, int, int, bytes]] = []  # arrival, sender, receiver, content
    for now in range(600):
        for i, one in enumerate(at):
            content, at[i] = late.send(one)
            arrive = [k for k in one.facts.neighbours if content and not (lossy and rng.random() < 0.6)]
            under_way.extend((now + int(rng.integers(0, 4)), i, k, content) for k in arrive)
        for i, one in enumerate(at):
            inbox = [(sender, content) for when, sender, to, content in under_way if when == now and to == i]
            at[i] = late.receive(inbox, known[i], one)
            if at[i].iteration < 30:
                assert at[i].present == expected[at[i].iteration][i]
                assert at[i].iteration - one.iteration in (0, 1)
        if min(one.iteration for one in at) >= 30:
            break
    assert min(one.iteration for one in at) >= 30
    assert now > 35


def test_scalar_aims_at_the_reference_and_sends_nothing() -> None:
    own = OwnData(0, np.ones(2), np.zeros(2), 0.0, HalfSpaces.empty(1, 1), np.array([2.0, 3.0]))
    local = LocalProblem(own, own.reference, no_rows(), Spread.of(own.p[None], own.xi[None]))
    alone = Synchronizer(Scalar(), lossy=True)
    at = alone.start(RobotFacts(0, 5, (1, 4), leads=True), local)
    content, at = alone.send(at)
    assert content == b""
    np.testing.assert_array_equal(alone.candidate(local, at), [2.0, 3.0])


def test_the_mean_gap_of_a_team_under_way_is_below_5_mm_at_one_round_a_tick() -> None:
    """The recommended optimizer under the certified layer, another robot than the leader knows the line: 20 s."""
    found = certified("governor.rounds=1")
    assert 0.0 < found.gap < 0.005
    assert found.violated == 0.0
