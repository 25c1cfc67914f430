"""References advance only so far that no robot's predicted way is longer than it sees."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.governor.certificate.evaluate import rows_of_model, worst_rows
from pbrg_mj.governor.certificate.prediction_grid import PredictionGrid
from pbrg_mj.governor.certificate.predictive import PredictiveCertificate
from pbrg_mj.governor.certificate.sight import SightLimit, sight
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.certified.governor import CertifiedGovernor
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.registry import governor
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.schema import Control
from pbrg_mj.world.scene.robot import load_robot_model
from tests.problems import FORMATION, graph

MODEL = TeamModel.of(graph(), Control(alpha_r=2.5), 0.01)
GRID = PredictionGrid.of(MODEL)
SIGHT = 0.8
BEAMS = np.array([0, 2, 4])


def farthest(p: np.ndarray, xi: np.ndarray, m: np.ndarray) -> float:
    """Return the longest way of a robot with beams at any tick, simulated; the motion's tail is all but over."""
    start, longest = p[BEAMS], 0.0
    for _ in range(GRID.horizon + 500):
        p, xi = MODEL.predicted(p, xi, m, 1)
        longest = max(longest, float(np.linalg.norm(p[BEAMS] - start, axis=1).max()))
    return longest


def predicted_crossing(spaces: HalfSpaces, p: np.ndarray, xi: np.ndarray, m: np.ndarray) -> float:
    """Return by how much the worst predicted position is beyond a half-space."""
    one = HalfSpaces(spaces.G[None], spaces.h[None], spaces.active[None], spaces.binds[None])
    return float(worst_rows(one, (p[None], xi[None], m[None, None]), FORMATION, rows_of_model(MODEL))[0, 2])


def test_the_share_is_the_largest_that_keeps_every_way_within_sight() -> None:
    rng, cut = np.random.default_rng(21), 0
    limit = SightLimit.of(GRID, BEAMS, SIGHT)
    for _ in range(12):
        p, xi = 0.1 * rng.normal(size=(5, 2)), 0.1 * rng.normal(size=(5, 2))
        xi -= xi.mean(axis=0)
        held, advance = p.mean(axis=0), 3.0 * rng.normal(size=2)
        kappa = limit.kappa(np.vstack([p - held, xi]), np.zeros(5), advance)
        way = farthest(p, xi, held + kappa * advance)
        assert way <= SIGHT + 2e-3  # between grid points a millimetre per metre of the error
        if kappa < 1.0:
            cut += 1
            assert way == pytest.approx(SIGHT, abs=5e-3)
    assert cut >= 6


def test_a_way_that_is_too_long_already_may_not_grow() -> None:
    limit, error = SightLimit.of(GRID, BEAMS, SIGHT), np.zeros((10, 2))
    error[:5, 0] = -2.0  # all robots are 2 m short of the held m
    assert limit.kappa(error, np.zeros(5), np.array([1.0, 0.0])) == 0.0
    assert limit.kappa(error, np.zeros(5), np.array([-0.5, 0.0])) == 1.0


@pytest.mark.parametrize("seed", [22, 23])
def test_a_wall_that_comes_into_view_asks_for_no_retreat(seed: int) -> None:
    """Ideal plant, walls unknown until one is within sight of a robot: holding is admissible in that very tick."""
    rng = np.random.default_rng(seed)
    angles, offsets = rng.uniform(0, 2 * np.pi, 4), rng.uniform(1.8, 5.0, 4)
    walls = np.column_stack([np.cos(angles), np.sin(angles)])
    certificate, governed = (
        PredictiveCertificate(GRID, FORMATION, 0.0),
        CertifiedGovernor((SightLimit.of(GRID, np.arange(5), SIGHT),), 2, np.inf),
    )
    p, xi = 0.1 * rng.normal(size=(5, 2)), np.zeros((5, 2))
    held, spaces, worst, seen = p.mean(axis=0), HalfSpaces.empty(5, 4), -np.inf, 0
    reference = 1e6 * walls[0]
    for tick in range(4000):
        if tick % 1000 == 999:
            reference = 30.0 * rng.normal(size=2)
        distance = offsets[:, None] - walls @ (p + FORMATION).T
        for wall in np.flatnonzero((distance.min(axis=1) <= SIGHT) & ~spaces.active[0]):
            spaces.G[0, wall], spaces.h[0, wall] = walls[wall], offsets[wall]
            spaces.active[0, wall] = spaces.binds[0, wall] = True
            assert predicted_crossing(spaces, p, xi, held) <= 2e-3
            seen += 1
        rows = certificate.rows_at(spaces, p, xi, held)
        solution, held = governed.step(Problem(graph(), p, xi, rows, reference, heading=np.zeros(5)), held)
        assert solution.status == "ok"
        p, xi = MODEL.predicted(p, xi, held, 1)
        worst = max(worst, float(-distance.min()))
    assert seen >= 2
    assert -0.05 < worst <= 1e-9


def test_sight_is_what_is_left_of_the_beams_range() -> None:
    scenario = load_scenario(
        "sensing/late_detection", ["sensors.beams.range_max=1.3", "sensors.beams.rate_hz=20"]
    ).scenario
    robot = load_robot_model()
    chord = np.sqrt(1.3**2 - 0.5**2)  # from there a metre of the wall is in range
    expected = chord - robot.hand_offset - robot.clearance - 0.1 * robot.wheel_radius * robot.loaded_speed
    assert sight(scenario, robot) == pytest.approx(expected)


def test_beams_too_short_for_any_advance_are_an_error() -> None:
    keys = ["governor.kind=certified", "sensors.beams.range_max=0.6"]
    with pytest.raises(InputError, match=r"governor.sight_rows.*beams of 0.6 m at 10 Hz"):
        governor(load_scenario("sensing/late_detection", keys).scenario)
    governor(load_scenario("sensing/late_detection", [*keys, "governor.sight_rows=false"]).scenario)
