"""The prediction behind motors and a delay: against a simulation robot by robot, and every claim searched for a lie."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.analysis.metrics import per_tick
from pbrg_mj.errors import InputError
from pbrg_mj.governor.certificate.evaluate import rows_of_model, worst_rows
from pbrg_mj.governor.certificate.prediction_grid import PredictionGrid
from pbrg_mj.governor.certificate.predictive import PredictiveCertificate
from pbrg_mj.governor.certificate.sight import SightLimit
from pbrg_mj.governor.certificate.speed import SpeedLimit, disc_facets
from pbrg_mj.governor.certificate.team_model import TeamModel, UnsettledTeamError
from pbrg_mj.governor.certified.compiled import CompiledDecision
from pbrg_mj.governor.certified.cycles import CycleGovernor
from pbrg_mj.governor.certified.governor import CertifiedGovernor
from pbrg_mj.governor.certified.robot import CertifiedProgram, state_struct
from pbrg_mj.governor.messaging.networked import NetworkedGovernor
from pbrg_mj.governor.messaging.program import OwnData
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.motion import prediction_state
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.governor.registry import governor, robot_programs
from pbrg_mj.loop.batch import side_by_side
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.schema import Control
from pbrg_mj.team.channel import Channel, Loss
from pbrg_mj.team.graph import network_of_edges
from pbrg_mj.team.network import Network
from pbrg_mj.transport.datagrams import own_message, read_own
from pbrg_mj.vehicle.motor_lag import MotorLag, latency, motor_lag
from tests.two_governors import answers

TICK, TAU = 0.01, 0.104


def ring(n: int, leader: int = 0) -> Network:
    return network_of_edges([(i, (i + 1) % n) for i in range(n)], np.eye(n)[leader])


@dataclass
class Plant:
    """Robots one by one, in numbers of Python: where they are, how fast, and where they were."""

    network: Network
    control: Control
    lag: MotorLag
    xi: list
    velocity: list
    places: list = field(default_factory=list)  # of all robots at every tick so far, d + 1 of them at least

    @classmethod
    def somewhere(cls, rng: np.random.Generator, network: Network, control: Control, lag: MotorLag, size=1.0):
        """Robots that have driven anyhow; xi has the sum 0."""
        n = network.robots
        xi = 0.2 * size * rng.normal(size=(n, 2))
        places = [size * rng.normal(size=(n, 2))]
        for _ in range(lag.delay):
            places.append(places[-1] + 0.01 * size * rng.normal(size=(n, 2)))
        velocity = 0.5 * size * rng.normal(size=(n, 2))
        return cls(
            network, control, lag, (xi - xi.mean(axis=0)).tolist(), velocity.tolist(), [*map(np.ndarray.tolist, places)]
        )

    @property
    def known(self) -> np.ndarray:
        return np.array(self.places[-1 - self.lag.delay])

    @property
    def motion(self) -> np.ndarray:
        """w, and the displacements of the last d ticks, the latest first."""
        places = np.array(self.places[-1 - self.lag.delay :])
        parts = [self.lag.time_constant * np.array(self.velocity), *np.diff(places, axis=0)[::-1]]
        return np.stack(parts, axis=1)

    def step(self, m: np.ndarray) -> np.ndarray:
        """Drive on for a tick; return what was commanded (n, 2)."""
        n, L, control, lag = self.network.robots, self.network.laplacian, self.control, self.lag
        seen, now = self.places[-1 - lag.delay], self.places[-1]
        left = math.exp(-lag.tick / lag.time_constant)
        placed, commands, rates = [], [], []
        for j in range(n):
            at, commanded, rate = [], [], []
            for axis in range(2):
                u = sum(-L[j][k] * (seen[k][axis] - self.xi[k][axis]) for k in range(n))
                u += control.alpha_r * self.network.leader[j] * (m[axis] - seen[j][axis])
                rate.append(-sum(L[j][k] * (seen[k][axis] + control.leak * self.xi[k][axis]) for k in range(n)))
                v = self.velocity[j][axis]
                at.append(now[j][axis] + u * lag.tick + (v - u) * lag.time_constant * (1.0 - left))
                self.velocity[j][axis] = u + (v - u) * left
                commanded.append(u)
            placed.append(at)
            commands.append(commanded)
            rates.append(rate)
        self.xi = [[x + lag.tick * r for x, r in zip(*both, strict=True)] for both in zip(self.xi, rates, strict=True)]
        self.places.append(placed)
        return np.array(commands)


@pytest.mark.parametrize("delay", [0, 1, 3, 10])
@pytest.mark.parametrize("n", [3, 4, 5])
def test_the_model_is_a_simulation_robot_by_robot(n: int, delay: int) -> None:
    """Places, xi, commands, and what every robot computes of its own motion, for 120 ticks under a constant m."""
    rng, control = np.random.default_rng(10 * n + delay), Control(alpha_r=1.7, leak=0.1)
    lag, m = MotorLag(TAU, delay, TICK), rng.normal(size=2)
    plant = Plant.somewhere(rng, ring(n), control, lag)
    model, motion = TeamModel.of(plant.network, control, TICK, lag), plant.motion
    start = prediction_state(plant.known, np.array(plant.xi), motion)
    for ticks in range(120):
        y, rest = model.predicted(*start, m, ticks)
        x = np.concatenate([y - m, rest])
        np.testing.assert_allclose(model.position @ x + m, plant.places[-1], rtol=0, atol=1e-12)
        np.testing.assert_allclose(rest[:n], plant.xi, rtol=0, atol=1e-12)
        np.testing.assert_allclose(motion, plant.motion, rtol=0, atol=1e-12)
        np.testing.assert_allclose(
            prediction_state(plant.known, np.array(plant.xi), motion)[1], rest, rtol=0, atol=1e-11
        )
        commands = plant.step(m)
        np.testing.assert_allclose(model.rate @ x, commands, rtol=0, atol=1e-11)
        motion = lag.after(motion, commands)


MODELS = {
    "ring of 5, no delay": (5, 2.5, 0.0, MotorLag(TAU, 0, TICK)),
    "ring of 5, 3 ticks": (5, 2.5, 0.0, MotorLag(TAU, 3, TICK)),
    "ring of 4, 8 ticks, leak": (4, 1.3, 0.1, MotorLag(0.05, 8, TICK)),
    "ring of 3, long ticks": (3, 1.0, 0.0, MotorLag(0.1, 2, 0.02)),
}


def named(name: str) -> tuple[TeamModel, Network, Control, MotorLag]:
    n, alpha_r, leak, lag = MODELS[name]
    team, control = ring(n), Control(alpha_r=alpha_r, leak=leak)
    return TeamModel.of(team, control, lag.tick, lag), team, control, lag


@pytest.mark.parametrize("name", MODELS)
def test_no_error_grows_by_more_than_the_factor_which_is_small(name: str) -> None:
    model = named(name)[0]
    power, largest = model.after(0), 1.0
    for _ in range(2000):
        power = power @ model.moving_part
        largest = max(largest, float(np.linalg.norm(power, 2)))
    assert largest <= model.growth * (1 + 1e-12)
    assert model.growth < 2.0


@pytest.mark.parametrize("name", MODELS)
def test_no_state_lies_beyond_the_rows(name: str) -> None:
    """Exact at grid points; between two of them and after the last, the worst state of all is within the bound.

    What row t is above the line between its neighbours' rows is linear in the state, so the worst state is known.
    """
    model = named(name)[0]
    grid, n = PredictionGrid.of(model, between=2e-3), model.robots
    rows, points = grid.E.reshape(n, -1, grid.E.shape[1]), grid.tick[:-1]
    every, E = [], model.after(0, model.position)
    for _ in range(grid.horizon + 1):
        every.append(E)
        E = E @ model.moving_part
    nearest = 0.0
    for k, (a, b) in enumerate(itertools.pairwise(points)):
        np.testing.assert_allclose(rows[:, k], every[a], atol=1e-11)
        for t in range(a + 1, b):
            share = (t - a) / (b - a)
            above = np.linalg.norm(every[t] - (1 - share) * every[a] - share * every[b], axis=1)
            limit = np.minimum(grid.bound[:, k], grid.bound[:, k + 1])
            assert np.all(above <= limit + 1e-12)
            nearest = max(nearest, float((above / limit).max()))
    assert nearest > 0.3  # the bound is at work, and not much too large
    for _ in range(300):
        assert np.all(np.linalg.norm(E, axis=1) <= grid.bound[:, -1] + 1e-12)
        E = E @ model.moving_part


def spaces_of(rng: np.random.Generator, n: int, formation: np.ndarray, room: float) -> HalfSpaces:
    """Return a half-space of every robot behind which the formation has some room about 0."""
    spaces, angle = HalfSpaces.empty(n, 1), rng.uniform(-np.pi, np.pi, size=(n, 1))
    spaces.active[:] = True
    spaces.G[:] = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    spaces.binds[:] = rng.random((n, 1, n)) < 0.7
    spaces.h[:] = np.max(spaces.G @ formation.T, axis=2) + rng.uniform(0.3 * room, room, size=(n, 1))
    return spaces


def no_rows(n: int) -> Rows:
    return Rows(np.zeros((n, 2)), np.zeros((n, 2, 2)), np.zeros((n, 2)), np.zeros((n, 2), dtype=bool))


def crossing(spaces: HalfSpaces, q: np.ndarray) -> float:
    return float(np.where(spaces.binds, spaces.G @ q.T - spaces.h[:, :, None], -np.inf).max())


@pytest.mark.parametrize("name", MODELS)
def test_what_the_rows_allow_keeps_the_simulated_team_behind_and_stays_allowed(name: str) -> None:
    """The nearest allowed point to a far target: no robot crosses in 20 s, and under it holding stays admissible."""
    model, team, control, lag = named(name)
    rng, n = np.random.default_rng(5), team.robots
    formation, tight = rng.normal(size=(n, 2)), 0
    certificate = PredictiveCertificate(PredictionGrid.of(model), formation, 0.0)
    decision = CompiledDecision.of(certificate, (), 5.0)
    for _ in range(6):
        plant = Plant.somewhere(rng, team, control, lag, 0.2)
        spaces, held = spaces_of(rng, n, formation, 3.0), plant.known.mean(axis=0)
        spaces.h[:] += 1.0  # so that holding is admissible
        problem = Problem(
            team, plant.known, np.array(plant.xi), no_rows(n), 10 * rng.normal(size=2), spaces, np.zeros(n)
        )
        problem = with_motion(problem, plant.motion)
        found = decision.next_reference(problem, held)
        assert found.status == "ok"
        m, worst = found.m[0], -np.inf
        states, own = (plant.known[None], np.array(plant.xi)[None], m[None, None]), plant.motion[None]
        at_once = HalfSpaces(*(array[None] for array in (spaces.G, spaces.h, spaces.active, spaces.binds)))
        evaluated = worst_rows(at_once, states, formation, rows_of_model(model), own)[0, 2]
        for tick in range(2000):
            worst = max(worst, crossing(spaces, np.array(plant.places[-1]) + formation))
            if tick % 20 == 0 and tick < 600:
                state = prediction_state(plant.known, np.array(plant.xi), plant.motion)
                allowed = certificate.advances(spaces, *state, m)
                assert allowed.low.max() <= 1e-9
                assert allowed.high.min() >= -1e-3  # the bounds between grid points change from tick to tick
            plant.step(m)
        assert worst <= 1e-9
        assert evaluated == pytest.approx(worst, abs=0.01)
        tight += worst > -0.02
    assert tight >= 2


def with_motion(problem: Problem, motion: np.ndarray) -> Problem:
    rows, reach = problem.rows, problem.reference_range
    given = (problem.network, problem.p, problem.xi, rows, problem.reference, problem.half_spaces, problem.heading)
    return Problem(*given, reach, motion)


def test_without_lag_and_delay_the_rows_are_the_kinematic_ones() -> None:
    rng, team, control = np.random.default_rng(7), ring(5), Control(alpha_r=2.5)
    formation, kinematic = rng.normal(size=(5, 2)), TeamModel.of(ring(5), control, TICK)
    advances, p, xi = [], rng.normal(size=(5, 2)), 0.2 * rng.normal(size=(5, 2))
    spaces, held = spaces_of(rng, 5, formation, 3.0), p.mean(axis=0)
    for tau in (0.0, 1e-3, 1e-1):
        model = TeamModel.of(team, control, TICK, MotorLag(tau, 0, TICK))
        certificate = PredictiveCertificate(PredictionGrid.of(model, between=0.0), formation, 0.0)
        found = certificate.advances(spaces, *prediction_state(p, xi, np.zeros((5, 1, 2))), held)
        advances.append(np.concatenate([found.low, found.high]))
    certificate = PredictiveCertificate(PredictionGrid.of(kinematic, between=0.0), formation, 0.0)
    found = certificate.advances(spaces, p, xi, held)
    expected = np.concatenate([found.low, found.high])
    there = np.isfinite(expected)
    apart = [float(np.abs(one[there] - expected[there]).max()) for one in advances]
    assert apart[0] <= 1e-9
    assert apart[0] < apart[1] < 0.02 < apart[2]


CYCLES = [(ring(5, 4), 1, 4), (ring(6), 2, 3), (ring(5), 7, 1)]  # team, rounds a tick, ticks a cycle


@pytest.mark.parametrize(("team", "rounds", "cycle_ticks"), CYCLES)
@pytest.mark.parametrize("delay", [0, 4])
def test_all_robots_at_once_are_the_robots_programs_bit_for_bit(
    team: Network, rounds: int, cycle_ticks: int, delay: int
) -> None:
    """And byte for byte: a robot's motion is 16 bytes for w, and for each displacement."""
    n, rng, control = team.robots, np.random.default_rng(9 + delay), Control(alpha_r=1.0)
    lag, formation = MotorLag(0.1, delay, 0.02), rng.normal(size=(team.robots, 2))
    model = TeamModel.of(team, control, lag.tick, lag)
    assert state_struct(model).size == 56 + 16 * (1 + delay)
    grid = PredictionGrid.of(model, 0.1)
    certificate = PredictiveCertificate(grid, formation, 0.0)
    limits = (SpeedLimit.of(model, grid, disc_facets(2.0, 6), 0.1), SightLimit.of(grid, np.array([0]), 1.0))
    carried = NetworkedGovernor(CertifiedProgram(team, certificate, model, limits, np.inf, cycle_ticks, 1), rounds)
    decision = CompiledDecision.of(certificate, limits, np.inf)
    at_once = CycleGovernor(team, model, decision, rounds, cycle_ticks)
    if cycle_ticks == 1:
        at_once = CertifiedGovernor(limits, team.diameter, np.inf, decision, state_bytes=state_struct(model).size)
    plant = Plant.somewhere(rng, team, control, lag, 0.3)
    ours = theirs = None
    applied = set()
    for tick in range(40):
        if tick % 7 == 0:
            spaces = spaces_of(rng, n, formation, 2.0)
        heading, aim = rng.uniform(-np.pi, np.pi, size=n), 3.0 * rng.normal(size=2)
        problem = Problem(team, plant.known, np.array(plant.xi), no_rows(n), aim, spaces, heading)
        problem = with_motion(problem, plant.motion)
        ours = at_once.init(problem) if ours is None else ours
        theirs = carried.init(problem) if theirs is None else theirs
        one, ours = at_once.step(problem, ours)
        other, theirs = carried.step(problem, theirs)
        leads = team.leader > 0.0
        np.testing.assert_array_equal(one.m[leads], other.m[leads])
        np.testing.assert_array_equal(one.bytes_sent, other.bytes_sent)
        assert one.status == other.status
        applied.add(one.m[leads].tobytes())
        plant.step(one.m[leads][0])
    assert len(applied) > 5


@pytest.mark.parametrize("lost", [0.0, 0.3])
def test_late_and_lost_messages_violate_no_prediction_of_the_model_s_own_team(lost: float) -> None:
    """In cycles of several ticks, against references that jump while robots still roll: 0 ticks, and m does move."""
    team, rng, control, lag = ring(5), np.random.default_rng(12), Control(alpha_r=2.5), MotorLag(TAU, 7, TICK)
    model, formation = TeamModel.of(team, control, TICK, lag), np.random.default_rng(3).normal(size=(5, 2))
    certificate, links = PredictiveCertificate(PredictionGrid.of(model), formation, 0.0), len(team.neighbours)
    program = CertifiedProgram(team, certificate, model, (), np.inf, 12, 2)
    outages = np.zeros((0, 3), dtype=np.int64)
    channel = Channel(np.full(links, 3), 0.0, Loss.independent(lost), 1, outages, 1 << 40, jitter=2)
    carried = NetworkedGovernor(program, 2, channel)
    plant = Plant.somewhere(rng, team, control, lag, 0.0)
    spaces, memory, applied, worst = spaces_of(rng, 5, formation, 1.5), None, [], -np.inf
    at_once = HalfSpaces(*(array[None] for array in (spaces.G, spaces.h, spaces.active, spaces.binds)))
    for tick in range(3000):
        if tick % 36 == 0:
            aim = 4.0 * rng.normal(size=2)
        problem = Problem(team, plant.known, np.array(plant.xi), no_rows(5), aim, spaces, np.zeros(5))
        problem = with_motion(problem, plant.motion)
        memory = carried.init(problem) if memory is None else memory
        solution, memory = carried.step(problem, memory)
        m = solution.m[0]
        states = (plant.known[None], np.array(plant.xi)[None], m[None, None])
        worst = max(worst, worst_rows(at_once, states, formation, rows_of_model(model), plant.motion[None])[0, 2])
        applied.append(m)
        plant.step(m)
    assert -0.05 < worst <= 1e-9
    assert len(np.unique(np.array(applied), axis=0)) > 10


def scenario_of(name: str, *overrides: str):
    keys = ["governor.kind=certified", "governor.predicted_motion=motors", "reference.solver=none", *overrides]
    return load_scenario(name, keys).scenario


def test_a_run_in_physics_predicts_motors_and_its_log_says_so(tmp_path, monkeypatch) -> None:
    """The metrics of the log, which has the commands alone, are those of the robots' own motion at every tick.

    Also where a log is read in several blocks.
    """
    monkeypatch.setattr(per_tick, "BLOCK_TICKS", 97)
    overrides = {"governor.kind": "certified", "governor.predicted_motion": "motors", "reference.solver": "none"}
    loaded = pbrg.load("obstacles/corner", overrides | {"sensors.camera.delay": 0.04}, duration=3.0)
    scenario = scenario_of("obstacles/corner", "sensors.camera.delay=0.04", "timing.duration=3.0")
    lag = motor_lag(scenario)
    assert lag == MotorLag(pytest.approx(0.104), 6, 0.01)  # 40 ms, and half a frame of 33 ms
    run = pbrg.run(loaded, log=tmp_path / "a.mcap")
    simulation = Simulation.build(scenario)
    leader, rows, expected = scenario.team.leaders[0] - 1, rows_of_model(TeamModel.of_scenario(scenario)), []
    for tick in simulation.control_ticks():
        spaces, problem = tick.half_spaces, tick.problem
        assert problem.motion.shape == (5, 7, 2)
        at_once = HalfSpaces(*(array[None] for array in (spaces.G, spaces.h, spaces.active, spaces.binds)))
        states = problem.p[None], problem.xi[None], tick.solution.m[leader][None, None]
        expected.append(worst_rows(at_once, states, simulation.loop.formation, rows, problem.motion[None])[0, 2])
    opened = pbrg.open(tmp_path / "a.mcap")
    for one in (run, opened):
        np.testing.assert_allclose(one.predictive_row_m, expected, rtol=0, atol=1e-9)
        assert one.metrics.own_certificate_violated_share == np.mean(np.array(expected) > 1e-6)
    assert certificate_metadata(tmp_path / "a.mcap")["predicted_motion"] == "motors"
    assert certificate_metadata(tmp_path / "a.mcap")["delay_ticks"] == "6"


def certificate_metadata(path) -> dict[str, str]:
    from mcap.reader import make_reader

    from pbrg_mj.log.schema import channels

    with path.open("rb") as file:
        found = {one.name: one.metadata for one in make_reader(file).iter_metadata()}
    return found[channels.CERTIFICATE_METADATA]


@pytest.mark.parametrize("rounds", [1, 10])
def test_a_scenario_s_governor_is_its_robots_programs(rounds: int) -> None:
    """In physics, in cycles of one tick and of several, bit for bit and byte for byte."""
    scenario = scenario_of("obstacles/corner", "timing.duration=1.0", f"governor.rounds={rounds}")
    at_once, carried = governor(scenario), robot_programs(scenario)
    assert isinstance(at_once, CertifiedGovernor if rounds == 10 else CycleGovernor)
    leader = scenario.team.leaders[0] - 1
    for one, other in answers(scenario, at_once, carried):
        np.testing.assert_array_equal(one.m[leader], other.m[leader])
        np.testing.assert_array_equal(one.bytes_sent, other.bytes_sent)


def test_delays_are_those_that_robots_assume() -> None:
    late = scenario_of("paper/experiment_near", "sensors.camera.delay=0.03", "radio={delay: 0.01, jitter: 0.02}")
    assert motor_lag(late).delay == 7  # 30 ms, half a frame, and 10 to 30 ms
    assert latency(late.sensors.camera, late.radio) == pytest.approx(0.03 + 1 / 60 + 0.02)
    unaware = scenario_of("paper/experiment_near", "sensors.camera.delay=0.03", "estimator.assumed.camera.delay=0")
    assert motor_lag(unaware).delay == 2
    kinematic = load_scenario("paper/experiment_near", ["governor.kind=certified"]).scenario
    assert motor_lag(kinematic) is None


def test_a_robot_in_a_process_of_its_own_hears_its_motion() -> None:
    rng = np.random.default_rng(1)
    for motion in (rng.normal(size=(4, 2)), None):
        own = OwnData(3, np.ones(2), np.zeros(2), 0.5, HalfSpaces.empty(1, 2), None, motion=motion)
        np.testing.assert_array_equal(read_own(3, own_message(own)).motion, motion)


REFUSED = {
    "plant": ("paper/simulation_inadmissible", ["governor.kind=certified"]),
    "kind": ("paper/experiment_near", []),
    "rollout": ("paper/experiment_near", ["governor.kind=rollout"]),
    "optimizer": ("paper/experiment_near", ["governor.kind=certified", "governor.optimizer=nids"]),
    "certificate": ("paper/experiment_near", ["governor.kind=certified", "governor.certificate=directional_ball"]),
    "centralized ball": ("paper/experiment_near", ["governor.kind=centralized"]),
    "speed loop": ("paper/experiment_near", ["governor.kind=certified", "drive.kind=speed_loop"]),
}


@pytest.mark.parametrize("case", REFUSED)
def test_everything_else_refuses_in_one_line(case: str) -> None:
    name, overrides = REFUSED[case]
    load_scenario(name, overrides)
    with pytest.raises(
        InputError, match=r"^governor\.predicted_motion: is motors with .*; allowed: kinematic, or"
    ) as error:
        load_scenario(name, [*overrides, "governor.predicted_motion=motors"])
    assert "\n" not in str(error.value)


def test_worlds_side_by_side_are_kinematic_and_others_run_one_by_one() -> None:
    assert side_by_side(load_scenario("paper/experiment_near", ["governor.kind=certified"]).scenario)
    assert not side_by_side(scenario_of("paper/experiment_near"))


def test_a_team_that_swings_up_behind_its_delays_is_refused() -> None:
    """Behind 0.104 s of lag the paper's ring stands 9 ticks of delay; its prediction ends at none from 10 on."""
    control = Control(alpha_r=2.5)
    assert TeamModel.of(ring(5), control, TICK, MotorLag(TAU, 9, TICK)).settling_ticks() > 0
    with pytest.raises(UnsettledTeamError):
        TeamModel.of(ring(5), control, TICK, MotorLag(TAU, 10, TICK)).settling_ticks()
    with pytest.raises(InputError, match="10 ticks of delay the team does not settle; allowed: kinematic"):
        governor(scenario_of("network/slow_radio"))


def test_the_centralized_governor_predicts_motors_as_the_certified_one() -> None:
    scenario = scenario_of("obstacles/corner", "timing.duration=2.0", "sensors.camera.delay=0.03")
    both = scenario.model_copy(update={"governor": scenario.governor.model_copy(update={"kind": "centralized"})})
    certificate, bound = PredictiveCertificate.of(both, 0.01), 0
    held = None
    for tick in Simulation.build(both).control_ticks():
        problem, rows = tick.problem, tick.problem.rows
        if held is not None:
            expected = certificate.rows_at(problem.half_spaces, *problem.prediction_state, held)
            np.testing.assert_array_equal(rows.d, expected.d)
            bound += np.any(rows.active)
        assert np.all((rows.C @ tick.solution.m[0] - rows.d)[rows.active] <= 1e-6)
        held = problem.network.leader @ tick.solution.m / problem.network.leaders
    assert bound > 100
