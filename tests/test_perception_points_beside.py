"""Points that stop a team beside a thing it could pass: normals that stay, and old echoes that lie beside it."""

from __future__ import annotations

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.perception.points.beams import SeenBeams
from pbrg_mj.perception.points.face import LEAST_HYSTERESIS, MOST_HYSTERESIS, hysteresis
from pbrg_mj.perception.points.memory import delete_stale, no_points
from pbrg_mj.perception.points.obstacle_points import empty_points
from pbrg_mj.perception.track.world_frame import ScanPose
from tests.seeing_points import estimator, sensor

AT_REST = ScanPose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.1)


@pytest.mark.parametrize("preset", ["generic", "lidar", "tof_ring"])
def test_a_robot_slides_past_a_column_that_is_hardly_beside_its_way(preset: str):
    """The equilibrium before it is unstable: off it by 3 cm, a robot goes round, whatever the noise of its normals."""
    world = {
        "timing": {"duration": 12.0},
        "team": {"start": [[0.0, 0.0]], "formation": [[0.0, 0.0]], "leaders": [1]},
        "operator": {"reference": [2.5, 0.0]},
        "world": {"columns": [{"center": [1.2, 0.03], "radius": 0.15}]},
        "sensors": {"beams": {"preset": preset, "robots": "all"}},
    }
    result = pbrg.run(pbrg.load(world, {"set_up": "recommended"}))
    assert np.linalg.norm(result.q_true_m[-1, 0] - [2.5, 0.0]) < 0.05
    assert result.wall_margin_m.min() > 0.0  # beyond the clearance


@pytest.mark.parametrize(
    ("pose_std", "may_cost"),
    [(0.001, LEAST_HYSTERESIS), (0.007, 0.007), (0.1, MOST_HYSTERESIS)],
    ids=["good", "fair", "late"],
)
def test_a_normal_stays_as_long_as_the_pose_is_wrong_by_more_than_it_costs(pose_std: float, may_cost: float):
    """That of the nearest place counts: one 1 m farther along the normal is known worse or better by ten times."""
    memory = no_points(1, 2)[0]
    memory["pose_std"] = [0.1 * pose_std if pose_std > 0.01 else 10.0 * pose_std, pose_std]
    window = empty_points(2, memory)
    window.x[:], window.y[:], window.point[:] = [1.0, 2.0], [0.3, 0.0], [1, 0]
    assert hysteresis((window, 2, np.zeros(4)), (1.0, 0.0)) == pytest.approx(may_cost, abs=1e-15)


@pytest.mark.parametrize(
    ("pose_std", "beside", "stays"),
    [(0.05, 0.9, False), (0.005, 0.9, True), (0.05, 2.5, True), (0.05, np.nan, True)],
    ids=["badly known", "well known", "another thing beside", "nothing beside"],
)
def test_an_old_echo_is_that_of_a_thing_beside_it_as_badly_as_its_pose_was_known(
    pose_std: float, beside: float, stays: bool
):
    """72 beams, of which those to the right of 5 degrees have echoes, and a point of an old scan at 10 degrees."""
    parameters = estimator()[0].parameters
    ranges, angles = np.full(72, np.nan), np.arctan2(parameters.directions[:, 1], parameters.directions[:, 0])
    ranges[(angles < np.deg2rad(5.1)) & (angles > np.deg2rad(-30.0))] = beside
    points = no_points(1, 1)[0]
    points[0]["x"], points[0]["y"] = 0.9 * np.cos(np.deg2rad(10.0)), 0.9 * np.sin(np.deg2rad(10.0))
    points[0]["std"], points[0]["pose_std"], points[0]["time"] = 0.005, pose_std, 0.5
    points[0]["live"] = points[0]["binds"] = True
    for scan in (20, 21):
        assert points[0]["live"]  # one scan is not enough
        delete_stale(points, scan, SeenBeams(ranges, parameters.directions), AT_REST, parameters)
    assert points[0]["live"] == stays


@pytest.mark.parametrize(("away", "stays"), [(0.13, True), (0.3, False)], ids=["in the blind zone", "farther"])
@pytest.mark.parametrize("preset", ["lidar", "lds_02"])
def test_what_is_nearer_than_beams_tell_stays_whatever_beams_beside_it_see(preset: str, away: float, stays: bool):
    """A corner, whose face goes on to the right: its own beam is silent since it is so near, not since it is gone."""
    parameters = estimator(sensor(preset))[0].parameters
    angles = np.arctan2(parameters.directions[:, 1], parameters.directions[:, 0])
    ranges = np.where((angles < -0.01) & (angles > -0.5), away + 0.04, np.nan)
    points = no_points(1, 1)[0]
    points[0]["x"], points[0]["std"], points[0]["pose_std"], points[0]["time"] = away, 0.005, 0.01, 0.5
    points[0]["live"] = points[0]["binds"] = True
    for scan in (20, 21):
        delete_stale(points, scan, SeenBeams(ranges, parameters.directions), AT_REST, parameters)
    assert points[0]["live"] == stays
