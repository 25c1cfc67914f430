"""The certified layer against what it promises: no loss, delay or optimizer makes it break its own certificate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from pbrg_mj.governor.certificate.by_name import CERTIFICATES
from pbrg_mj.governor.certificate.directional_ball import DirectionalBall
from pbrg_mj.governor.certificate.evaluate import rows_of_model, worst_rows
from pbrg_mj.governor.certificate.predictive import PredictiveCertificate
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.certified.consensus import Verdict
from pbrg_mj.governor.certified.flood import COUNT, Flood
from pbrg_mj.governor.certified.layer import LayerProgram
from pbrg_mj.governor.certified.reference_update import NO_ROWS, PredictedTeam, reference_update
from pbrg_mj.governor.certified.robot import OF_VERDICT, CertifiedProgram
from pbrg_mj.governor.certified.vectorized import LayerGovernor
from pbrg_mj.governor.messaging.networked import NetworkedGovernor
from pbrg_mj.governor.optimizers.by_name import OPTIMIZERS
from pbrg_mj.governor.problem.ball import BallCertificate, ball_rows
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import row_values
from pbrg_mj.governor.registry import governor
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.channel import Channel, Loss
from pbrg_mj.team.graph import network


def layered(name: str, *overrides: str) -> Scenario:
    return load_scenario(name, ["governor.kind=certified", "reference.solver=none", *overrides]).scenario


@pytest.mark.parametrize(
    ("name", "keys"),
    [
        ("obstacles/corner", ["governor.optimizer=nids", "governor.rounds=4"]),
        ("obstacles/corner", ["governor.optimizer=scalar", "governor.certificate=directional_ball"]),
        ("team/two_leaders", ["governor.optimizer=admm", "governor.rounds=6"]),
        ("paper/simulation_inadmissible", ["governor.optimizer=paper_flow", "governor.certificate=ball"]),
    ],
)
def test_the_layer_at_once_is_the_robots_program(name: str, keys: list[str]) -> None:
    """Bit for bit, but for the paper's flow, whose compiled rounds round otherwise; byte for byte."""
    scenario = layered(name, *keys, "timing.duration=0.6")
    at_once = governor(scenario)
    assert isinstance(at_once, LayerGovernor)
    carried = NetworkedGovernor(at_once.layer, scenario.governor.rounds)
    leaders, exact = np.array(scenario.team.leaders) - 1, scenario.governor.optimizer != "paper_flow"
    ours = theirs = None
    for tick in Simulation.build(scenario).control_ticks():
        ours = at_once.init(tick.problem) if ours is None else ours
        theirs = carried.init(tick.problem) if theirs is None else theirs
        one, ours = at_once.step(tick.problem, ours)
        other, theirs = carried.step(tick.problem, theirs)
        np.testing.assert_allclose(one.m[leaders], other.m[leaders], rtol=0.0, atol=0.0 if exact else 1e-9)
        np.testing.assert_array_equal(one.bytes_sent, other.bytes_sent)
        assert one.status == other.status


@pytest.mark.parametrize("optimizer", ["flooding", "nids"])
def test_an_only_leader_holds_its_place_for_one_cycle_and_then_moves(optimizer: str) -> None:
    scenario = layered(
        "paper/simulation_inadmissible",
        f"governor.optimizer={optimizer}",
        "governor.rounds=1",
        "timing.duration=0.07",
    )
    ticks = list(Simulation.build(scenario).control_ticks())
    m = np.array([tick.solution.m[4] for tick in ticks])  # robot 5 leads; a cycle has four ticks
    np.testing.assert_array_equal(m[:3], np.tile(ticks[0].problem.p[4], (3, 1)))
    assert np.linalg.norm(m[3] - m[2]) > 0.5
    np.testing.assert_array_equal(m[3:7], np.tile(m[3], (4, 1)))


def test_a_candidate_farther_from_r_than_what_is_held_waits() -> None:
    p, reference = np.zeros((5, 2)), np.array([1.0, 0.0])
    for candidate, taken in (([0.4, 0.0], True), ([-0.1, 0.0], False), ([1.0, 1.1], False), ([2.1, 0.0], False)):
        predicted = PredictedTeam(p, p, np.zeros(5), np.zeros(2), np.array(candidate), rows_requested=False)
        m, status = reference_update(predicted, 0.5, NO_ROWS, (), reference)
        np.testing.assert_allclose(m, 0.5 * np.array(candidate) if taken else np.zeros(2))
        assert status == "ok"
        np.testing.assert_allclose(
            reference_update(predicted, 0.5, NO_ROWS, ())[0], 0.5 * np.array(candidate)
        )  # among several leaders


@pytest.mark.parametrize("delay", ["0", "10"])
def test_an_optimizer_that_diverges_is_told_and_m_is_held(delay: str) -> None:
    """A step of the flow that is too long for the ball's rows; in both forms of the layer."""
    keys = ["governor.optimizer=flow_in_m", "governor.certificate=ball", f"network.delay_rounds={delay}"]
    scenario = layered("paper/simulation_inadmissible", *keys, "governor.flow_in_m.step=0.3", "timing.duration=3.0")
    ticks = list(Simulation.build(scenario).control_ticks())
    assert isinstance(governor(scenario), LayerGovernor) == (delay == "0")
    status = [tick.solution.status for tick in ticks]
    since = status.index("diverged")
    assert since > 0
    assert set(status[since:]) == {"diverged"}
    m = np.array([tick.solution.m[4] for tick in ticks])
    assert np.all(m[since:] == m[since])
    assert np.abs(m).max() < 3.0


class Course:
    """The paper's team in the ideal plant, driven by the layer towards references that change, some very far away."""

    def __init__(self, certificate: str, *overrides: str) -> None:
        keys = [f"governor.certificate={certificate}", "governor.rounds=2", "estimator.given.0.robot=2", *overrides]
        self.scenario = layered("paper/simulation_inadmissible", *keys)
        self.team, self.model = network(self.scenario), TeamModel.of_scenario(self.scenario)
        self.formation = np.array(self.scenario.team.formation)
        self.spaces = HalfSpaces.empty(5, 1)
        self.spaces.G[1, 0], self.spaces.h[1, 0] = np.full(2, np.sqrt(0.5)), 3.0 * np.sqrt(0.5)
        self.spaces.active[1, 0] = self.spaces.binds[1, 0] = True
        self.judge = CERTIFICATES[certificate](self.scenario, self.team)

    def violation(self, p: np.ndarray, xi: np.ndarray, m: np.ndarray) -> float:
        """By how much the scenario's own certificate is violated; negative: what it leaves."""
        if isinstance(self.judge, PredictiveCertificate):
            now = HalfSpaces(*(getattr(self.spaces, name)[None] for name in ("G", "h", "active", "binds")))
            states = p[None], xi[None], m[None, None]
            return float(worst_rows(now, states, self.formation, rows_of_model(self.model))[0, 2])
        if isinstance(self.judge, BallCertificate):
            return float(row_values(self.judge.rows(self.spaces), m, p, xi).max())
        assert isinstance(self.judge, DirectionalBall)
        G = self.spaces.G[1, 0]
        size = np.linalg.norm(np.concatenate([(p - m) @ G, xi @ G]))
        return float(self.judge.growth * size + G @ m + (self.formation @ G).max() - self.spaces.h[1, 0])

    def drive(self, carried: NetworkedGovernor, ticks: int, seed: int) -> tuple[float, float]:
        """Return the worst violation at any tick, and how far m went."""
        rng, p, xi = np.random.default_rng(seed), np.tile([-0.2, 0.1], (5, 1)), np.zeros((5, 2))
        p = p + 0.02 * rng.normal(size=(5, 2))
        worst, memory, rows, path, before = -np.inf, None, ball_rows(self.spaces, self.formation), 0.0, None
        reference = np.ones(2)
        for tick in range(ticks):
            if tick % 40 == 0:
                reference = 10.0 ** rng.uniform(0, 6) * (np.ones(2) + 0.5 * rng.normal(size=2))
            now = Problem(self.team, p, xi, rows, reference, self.spaces, np.zeros(5), 5.0)
            memory = carried.init(now) if memory is None else memory
            solution, memory = carried.step(now, memory)
            m = solution.m[4]
            worst = max(worst, self.violation(p, xi, m))
            path, before = path + (0.0 if before is None else float(np.linalg.norm(m - before))), m
            p, xi = self.model.predicted(p, xi, m, 1)
        return worst, path


@pytest.mark.slow
@pytest.mark.parametrize("certificate", ["ball", "directional_ball", "predictive"])
@pytest.mark.parametrize(
    "keys",
    [
        ["network.delay_rounds=20"],  # 0.1 s
        ["network.delay_rounds=100"],  # 0.5 s
        ["network.delay_rounds=4", "network.jitter_rounds=20"],
        ["network.loss=0.9"],
    ],
)
def test_the_certificate_holds_at_every_tick_however_late_or_lost_messages_are(
    certificate: str, keys: list[str]
) -> None:
    course = Course(certificate, "governor.optimizer=nids", *keys)
    carried = governor(course.scenario)
    assert isinstance(carried, NetworkedGovernor)
    worst, path = course.drive(carried, 900, seed=61)
    assert worst <= 1e-8
    assert path > 0.05


@dataclass(frozen=True)
class Adversary(Channel):
    """Loses and delays as a schedule says: (rounds, E) extra rounds, negative for lost."""

    schedule: np.ndarray = field(default_factory=lambda: np.zeros((1, 1), dtype=np.int64))

    def lost(self, was_bad: np.ndarray, first: int, rounds: int) -> np.ndarray:
        return self.schedule[first : first + rounds] < 0

    def arrivals(self, last: np.ndarray, first: int, rounds: int) -> np.ndarray:
        now = np.arange(first, first + rounds)[:, None]
        return now + np.maximum(self.schedule[first : first + rounds], 0)


def scheduled(course: Course, schedule: np.ndarray) -> NetworkedGovernor:
    """The robots' program with cycles of two ticks, as if all were in time, while this happens to their messages."""
    carried = governor(course.scenario)
    assert isinstance(carried, NetworkedGovernor)
    assert isinstance(carried.program, LayerProgram | CertifiedProgram)
    program = replace(carried.program, cycle_ticks=2, repeats=1)
    lines = Adversary(
        np.zeros(10, dtype=np.int64), 0.0, Loss(), 1, np.zeros((0, 3), np.int64), 10**9, schedule=schedule
    )
    return replace(carried, program=program, channel=lines)


def worst_found(course: Course, ticks: int, tries: int, seed: int) -> float:
    """Search for a schedule that makes the layer break its certificate: change stretches of the worst one."""
    rng = np.random.default_rng(seed)
    best, worst = np.zeros((2 * ticks, 10), dtype=np.int64), -np.inf
    for _ in range(tries):
        schedule = best.copy()
        for _ in range(8):
            start, length, link = rng.integers(2 * ticks), rng.integers(1, 12), rng.integers(10)
            schedule[start : start + length, link] = rng.choice([-1, -1, 1, 3, 9])
        found, _ = course.drive(scheduled(course, schedule), ticks, seed)
        if found >= worst:
            best, worst = schedule, found
    return worst


OPTIMIZER_AND_CERTIFICATE = [
    (optimizer, certificate)
    for optimizer in ("flooding", *OPTIMIZERS)
    for certificate in ("ball", "directional_ball", "predictive")
    if (optimizer, certificate) != ("flooding", "ball")
]


@pytest.mark.parametrize(("optimizer", "certificate"), OPTIMIZER_AND_CERTIFICATE)
@pytest.mark.parametrize(
    ("ticks", "tries", "seeds"), [(80, 6, 1), pytest.param(120, 10, 2, marks=pytest.mark.slow)], ids=["short", "long"]
)
def test_no_schedule_of_losses_and_delays_makes_robots_commit_wrongly(
    optimizer: str, certificate: str, ticks: int, tries: int, seeds: int
) -> None:
    course = Course(certificate, f"governor.optimizer={optimizer}", "network.loss=0.5")
    for seed in range(62, 62 + seeds):
        assert worst_found(course, ticks, tries, seed) <= 1e-8


@pytest.mark.parametrize("optimizer", ["scalar", "flooding"])
def test_the_search_finds_what_robots_commit_that_do_not_wait(optimizer: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if optimizer == "scalar":
        monkeypatch.setattr(Verdict, "complete", lambda self, robots: self.robots != 0)
    else:
        monkeypatch.setattr(Flood, "contents", what_has_come(Flood.contents))
    course = Course("predictive", f"governor.optimizer={optimizer}", "network.loss=0.5")
    assert worst_found(course, 80, 6, seed=62) > 0.01


def what_has_come(contents: Callable[..., list[bytes] | None]) -> Callable[..., list[bytes] | None]:
    """Take a robot whose verdict is missing for one that sees nothing."""

    def found(flood: Flood, kind: int, robots: int) -> list[bytes] | None:
        if kind != OF_VERDICT:
            return contents(flood, kind, robots)
        return [flood.content(kind, robot) or COUNT.pack(0) for robot in range(robots)]

    return found


@pytest.mark.parametrize(("certificate", "back"), [("ball", 0.005), ("directional_ball", 0.005), ("predictive", 1.99)])
@pytest.mark.parametrize("distance", [-0.005, 0.001])
def test_a_team_at_or_beyond_its_line_comes_back(certificate: str, back: float, distance: float) -> None:
    """At rest 5 mm beyond the line or 1 mm before it, called 2 m back: no deadlock, no farther across. Balls creep."""
    course = Course(certificate, "governor.optimizer=scalar", "governor.rounds=4")
    at_once, G = governor(course.scenario), np.full(2, np.sqrt(0.5))
    start = G * (3.0 * np.sqrt(0.5) - distance)
    p, xi, memory, worst = np.tile(start, (5, 1)), np.zeros((5, 2)), None, -np.inf
    rows, aim, m = ball_rows(course.spaces, course.formation), start - 2.0 * G, start
    for _ in range(1200):
        now = Problem(course.team, p, xi, rows, aim, course.spaces, np.zeros(5))
        memory = at_once.init(now) if memory is None else memory
        solution, memory = at_once.step(now, memory)
        m = solution.m[4]
        p, xi = course.model.predicted(p, xi, m, 1)
        worst = max(worst, float((p @ G).max() - 3.0 * np.sqrt(0.5)))
    assert worst <= max(-distance, 0.0) + 1e-9
    assert (start - m) @ G > back


@pytest.mark.slow
def test_a_wall_seen_late_is_not_touched() -> None:
    """In physics, faster than the robots see: the layer keeps the team off a wall that the paper's governor touches."""
    keys = ["timing.duration=10.0", "reference.solver=none", "governor.sight_rows=false"]
    scenario = load_scenario("sensing/late_detection_guarded", keys).scenario
    tick = None
    for tick in Simulation.build(scenario).control_ticks():
        assert tick.hand_world[:, 0].max() < 1.35  # the hand points' line is at 1.4
    assert tick is not None
    assert tick.hand_world[:, 0].max() > 0.0  # and it has come nearer: the foremost started at -2.5
