"""Whole runs of the certified governor: far references, starts beyond a line, late walls: no crossing, no deadlock."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pbrg_mj.governor.certificate.evaluate import NAMES, predicted_rows, worst_rows
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.schema import Scenario

ON_LINE = 1.5 + np.array([[-1.0, 1.0], [-1.0, -1.0], [0.0, -1.0], [1.0, -1.0], [0.0, 0.0]])
IDEAL_EXPERIMENT = ("plant=ideal", "estimator.source=given", "estimator.given=[{robot: 5, normal: [1, 1], offset: 3}]")
SCRIPTS = Path(__file__).parents[1] / "scripts"


def ideal(name: str, *overrides: str) -> Scenario:
    return load_scenario(name, ["reference.solver=none", *overrides]).scenario


def shifted_points(scenario: Scenario) -> tuple[np.ndarray, float]:
    """Run it; return p (T, n, 2), and by how much the worst prediction of all ticks crosses."""
    leader, p, xi, m, spaces = scenario.team.leaders[0] - 1, [], [], [], []
    for tick in Simulation.build(scenario).control_ticks():
        p.append(tick.problem.p.copy())
        xi.append(tick.problem.xi.copy())
        m.append(tick.solution.m[leader][None].copy())
        spaces.append(tick.half_spaces)
    stacked = HalfSpaces(*(np.array([getattr(one, name) for one in spaces]) for name in ("G", "h", "active", "binds")))
    states, formation = (np.array(p), np.array(xi), np.array(m)), np.array(scenario.team.formation)
    worst = worst_rows(stacked, states, formation, predicted_rows(scenario))
    return states[0], float(worst[:, NAMES.index("predictive")].max())


def crossing(points: np.ndarray) -> np.ndarray:
    """Return by how much the foremost robot is beyond x + y = 3 at every tick (T,) [m]; robots 1 and 5 lead there."""
    return (points.sum(axis=2) - 3.0)[:, [0, 3, 4]].max(axis=1) / np.sqrt(2.0)


def gap(points: np.ndarray, target: tuple[float, float]) -> float:
    return float(np.linalg.norm(points[-1] - target, axis=1).max())


@pytest.mark.parametrize("distance", [1e1, 9e5])
def test_a_reference_far_beyond_the_line_is_as_one_on_it(distance: float) -> None:
    scenario = ideal(
        "paper/simulation_inadmissible",
        "governor.kind=certified",
        "timing.duration=20.0",
        f"operator.reference={[1.0 + distance, 2.0 + distance]}",
    )
    points, worst = shifted_points(scenario)
    assert worst <= 1e-9
    assert crossing(points).max() <= 1e-9
    assert gap(points, (1.0, 2.0)) < 0.1


@pytest.mark.parametrize(
    ("reference", "target"), [((-1.7, -1.7), (-1.7, -1.7)), ((2.0, 3.0), (1.0, 2.0)), ((1e6, 1e6), (1.5, 1.5))]
)
def test_a_team_beyond_its_line_comes_back_and_goes_on(
    reference: tuple[float, float], target: tuple[float, float]
) -> None:
    start = (ON_LINE + 0.005 / np.sqrt(2.0)).tolist()
    scenario = ideal(
        "paper/simulation_inadmissible",
        "governor.kind=certified",
        "timing.duration=25.0",
        f"team.start={start}",
        f"operator.reference={list(reference)}",
    )
    points, _ = shifted_points(scenario)
    beyond = crossing(points)
    assert beyond[0] == pytest.approx(0.005, abs=1e-9)
    assert beyond.max() <= 0.005 + 1e-9
    assert beyond[1000:].max() <= 1e-4  # it tends to the line, or leaves it
    assert gap(points, target) < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["inadmissible", "near"])
def test_the_ideal_simulations_end_at_the_best_point_and_no_prediction_crosses(name: str) -> None:
    points, worst = shifted_points(ideal(f"paper/simulation_{name}", "governor.kind=certified"))
    assert gap(points, (1.0, 2.0)) <= 1e-4
    assert worst <= 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "overrides", "target"),
    [("simulation_near", (), (1.0, 2.0)), ("experiment_near", IDEAL_EXPERIMENT, (1.4, 1.18))],
)
def test_where_the_reference_is_admissible_the_governor_costs_no_time(
    name: str, overrides: tuple[str, ...], target: tuple[float, float]
) -> None:
    def settling(kind: str) -> float:
        scenario = ideal(f"paper/{name}", "timing.duration=30.0", *overrides, f"governor.kind={kind}")
        formation = np.array(scenario.team.formation)
        away = [
            np.linalg.norm(tick.hand_world - formation - target, axis=1).max()
            for tick in Simulation.build(scenario).control_ticks()
        ]
        late = np.flatnonzero(np.array(away) > scenario.outcome.tolerance)
        return float(late[-1] + 1) * scenario.timing.tick

    assert settling("certified") <= 1.05 * settling("none") < 1.05 * 29.0


@pytest.mark.slow
def test_the_optimum_of_the_directional_ball_reaches_the_best_point() -> None:
    scenario = ideal(
        "paper/simulation_inadmissible",
        "governor.kind=centralized",
        "governor.certificate=directional_ball",
        "timing.duration=200.0",
    )
    points, _ = shifted_points(scenario)
    assert crossing(points).max() <= 1e-6
    assert gap(points, (1.0, 2.0)) <= 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2001, 2002, 2003])
def test_no_random_wall_seen_late_is_crossed(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(SCRIPTS)
    from late_walls import world

    scenario = load_scenario("sensing/late_detection", [*world(seed), "governor.kind=certified"]).scenario
    wall = scenario.world.walls[0]
    start, end = np.array(wall.start), np.array(wall.end)
    along = (end - start) / np.linalg.norm(end - start)
    normal = np.array([along[1], -along[0]])
    face = normal @ start - wall.thickness / 2.0
    room, seen = [], False
    for tick in Simulation.build(scenario).control_ticks():
        room.append(face - 0.1 - (tick.hand_world @ normal).max())
        seen |= bool(tick.half_spaces.active.any())
    assert room[0] > 1.0
    assert seen
    assert min(room) > 0.0


@pytest.mark.parametrize("governor", ["certified", "rollout"])
def test_a_team_with_beams_does_not_slide_along_a_wall_towards_a_far_reference(governor: str) -> None:
    """A normal that noise turns by 1e-5 moved the best m by 14 m: m wandered by 11 m, and past the wall's end."""
    overrides = [f"governor.kind={governor}", "operator.reference=[1.0e+6, 1.0e+6]", "timing.duration=12.0"]
    scenario = load_scenario("paper/experiment_inadmissible", ["reference.solver=none", *overrides]).scenario
    leader = scenario.team.leaders[0] - 1
    along = [
        float(np.array([1.0, -1.0]) / np.sqrt(2.0) @ tick.solution.m[leader])
        for tick in Simulation.build(scenario).control_ticks()
    ]
    assert np.abs(along[400:]).max() < 0.3
