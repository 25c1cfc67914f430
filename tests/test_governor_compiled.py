"""The certified decision of a tick, compiled, against the same in NumPy; and rows that are made for who reads them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pbrg_mj.governor.certificate.directional_ball import DirectionalBall
from pbrg_mj.governor.certificate.prediction_grid import PredictionGrid
from pbrg_mj.governor.certificate.predictive import PredictiveCertificate
from pbrg_mj.governor.certificate.sight import SightLimit
from pbrg_mj.governor.certificate.speed import SpeedLimit, disc_facets
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.certified.compiled import CompiledDecision
from pbrg_mj.governor.certified.governor import CertifiedGovernor
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.lazy_rows import LazyRows
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.team.graph import network

SCENARIO = load_scenario("paper/simulation_inadmissible", ["governor.kind=certified"]).scenario
TEAM, MODEL = network(SCENARIO), TeamModel.of_scenario(SCENARIO)
GRID, FORMATION = PredictionGrid.of(MODEL), np.array(SCENARIO.team.formation)
SPEED = SpeedLimit.of(MODEL, GRID, disc_facets(0.5, 8), 0.1)
SIGHT = SightLimit.of(GRID, np.array([0, 3]), 0.6)
REACH = 0.3  # [m] some retreats are longer


def random_problem(rng: np.random.Generator, certificate: DirectionalBall | PredictiveCertificate) -> tuple:
    """Return a problem and a held m: some half-spaces empty, held m's beyond some, references near and far."""
    p, xi = 0.2 * rng.normal(size=(5, 2)), 0.1 * rng.normal(size=(5, 2))
    spaces, angle = HalfSpaces.empty(5, 2), rng.uniform(-np.pi, np.pi, size=(5, 2))
    spaces.active[:] = rng.random((5, 2)) < 0.4
    spaces.G[spaces.active] = np.stack([np.cos(angle), np.sin(angle)], axis=-1)[spaces.active]
    spaces.binds[spaces.active] = rng.random((5, 2, 5))[spaces.active] < 0.5
    reach = np.max(spaces.G @ FORMATION.T, axis=2) + rng.uniform(-0.1, 2.0)
    spaces.h[:] = np.where(spaces.active, reach, 0.0)
    held = p.mean(axis=0) + 0.1 * rng.normal(size=2)
    rows = certificate.rows_at(spaces, p, xi, held)
    reference = 10.0 ** rng.uniform(-2, 3) * rng.normal(size=2)
    return Problem(TEAM, p, xi, rows, reference, spaces, rng.uniform(-np.pi, np.pi, size=5)), held


@pytest.mark.parametrize("farthest", [np.inf, 2.0])
@pytest.mark.parametrize("limits", [(), (SPEED,), (SPEED, SIGHT)], ids=["free", "speed", "speed and sight"])
@pytest.mark.parametrize(
    "certificate",
    [PredictiveCertificate(GRID, FORMATION, 0.01), DirectionalBall(FORMATION, MODEL.growth, 0.0)],
    ids=["predictive", "directional ball"],
)
def test_the_compiled_decision_is_the_one_in_numpy_bit_for_bit(certificate, limits, farthest) -> None:
    rng, seen = np.random.default_rng(31), set()
    in_numpy = CertifiedGovernor(limits, 2, REACH, None, farthest)
    compiled = CertifiedGovernor(limits, 2, REACH, CompiledDecision.of(certificate, limits, REACH, farthest), farthest)
    for _ in range(150):
        problem, held = random_problem(rng, certificate)
        one, one_held = compiled.step(problem, held)
        other, other_held = in_numpy.step(problem, held)
        np.testing.assert_array_equal(one.m, other.m)
        np.testing.assert_array_equal(one_held, other_held)
        np.testing.assert_array_equal(one.bytes_sent, other.bytes_sent)
        assert one.status == other.status
        centre = problem.p.mean(axis=0)
        most = max(REACH, np.linalg.norm(held - centre)) if limits else REACH
        assert one.status == "ok" or np.linalg.norm(one_held - centre) <= most * (1 + 1e-12)
        assert one.multipliers.shape == other.multipliers.shape
        values = problem.row_values(held)
        admissible_now = values.max() <= 0.0
        seen.add((one.status, bool(admissible_now), bool(np.allclose(one.m[0], problem.reference))))
    assert {("infeasible", False, False), ("ok", False, False), ("ok", True, False), ("ok", True, True)} <= seen
    # Rows of a ball are met near the team; those of a prediction bind far references, too.
    assert ("inadmissible", False, False) in seen or isinstance(certificate, DirectionalBall)


@pytest.mark.parametrize("in_numpy", [False, True])
def test_a_far_reference_is_taken_from_no_farther_than_normals_are_known(in_numpy: bool) -> None:
    """A normal that is wrong by an angle moves the best m by that angle times the distance of r, which ends there."""
    farthest, wrong, rng = 20.0, 1e-3, np.random.default_rng(33)
    certificate = DirectionalBall(np.zeros((5, 2)), 1.0, 0.0)
    compiled = None if in_numpy else CompiledDecision.of(certificate, (), np.inf, farthest)
    governor, p = CertifiedGovernor((), 2, np.inf, compiled, farthest), np.tile([0.3, 0.1], (5, 1))

    def best(angle: float, reference: np.ndarray, wall: bool = True) -> np.ndarray:
        spaces = HalfSpaces.empty(5, 1)
        spaces.G[0, 0], spaces.h[0, 0] = [np.cos(angle), np.sin(angle)], 1.0 + p[0] @ [np.cos(angle), np.sin(angle)]
        spaces.active[0, 0], spaces.binds[0, 0] = wall, True
        rows = certificate.rows_at(spaces, p, np.zeros((5, 2)), p[0])
        problem = Problem(TEAM, p, np.zeros((5, 2)), rows, reference, spaces, np.zeros(5))
        return governor.step(problem, p[0])[1]

    for angle in rng.uniform(-np.pi, np.pi, size=20):
        towards = np.array([np.cos(angle), np.sin(angle)])
        for distance in (10.0, 1e3, 1e6):
            moved = best(angle + wrong, p[0] + distance * towards) - best(angle, p[0] + distance * towards)
            assert np.linalg.norm(moved) <= 1.1 * wrong * min(distance, farthest)
        np.testing.assert_array_equal(best(0.0, p[0] + 19.9 * towards, wall=False), p[0] + 19.9 * towards)  # as it is
        np.testing.assert_allclose(best(0.0, p[0] + 1e6 * towards, wall=False), p[0] + farthest * towards)


@pytest.mark.parametrize("in_numpy", [False, True])
def test_where_rows_contradict_each_other_m_moves_no_faster_than_motors_follow(in_numpy: bool) -> None:
    certificate, most, rng, slowed = PredictiveCertificate(GRID, FORMATION, 0.01), 0.05, np.random.default_rng(32), 0
    limits = (SpeedLimit.of(MODEL, GRID, np.zeros((0, 2)), 0.1, disc_facets(most, 8)),)
    for _ in range(150):
        problem, held = random_problem(rng, certificate)
        compiled = None if in_numpy else CompiledDecision.of(certificate, limits, REACH)
        solution, m = CertifiedGovernor(limits, 2, REACH, compiled).step(problem, held)
        if solution.status == "ok":
            continue
        goal = CertifiedGovernor((), 2, REACH).step(problem, held)[1]
        step, way = m - held, goal - held
        assert abs(step[0] * way[1] - step[1] * way[0]) <= 1e-12  # towards where it would be at once
        assert 0.0 <= step @ way <= way @ way + 1e-12
        assert SCENARIO.control.alpha_r * np.linalg.norm(step) <= most + 1e-12  # of eq. 2, of who leads
        before, now, then = (problem.row_values(one).max() for one in (held, m, goal))
        assert now <= max(before, then) + 1e-12
        slowed += np.linalg.norm(step) < np.linalg.norm(way) - 1e-9
    assert slowed >= 10


def test_the_closed_loop_makes_no_rows_of_the_state_and_who_reads_them_gets_them() -> None:
    scenario = load_scenario("obstacles/corner", ["governor.kind=certified", "timing.duration=0.05"]).scenario
    ticks = list(Simulation.build(scenario).control_ticks())
    held = ticks[0].problem.p.mean(axis=0)
    certificate = PredictiveCertificate.of(scenario, 0.01)
    for tick in ticks:
        problem = tick.problem
        assert isinstance(vars(problem)["rows"], LazyRows)
        assert problem.rows_shape == tick.solution.multipliers.shape
        expected = certificate.rows_at(tick.half_spaces, problem.p, problem.xi, held)
        for ours, theirs in zip(problem.rows, expected, strict=True):
            np.testing.assert_array_equal(ours, theirs)
        assert problem.rows is problem.rows
        assert dataclasses.replace(problem, reference=np.ones(2)).rows is problem.rows
        held = tick.solution.m[0]
