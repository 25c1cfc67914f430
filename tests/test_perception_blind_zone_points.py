"""Points of what moves, nearer than beams tell: they go on with it, and what rests stays."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.points.blind_zone_points import (
    assign_velocities,
    blind_zone_margin,
    predict_blind_zone_points,
)
from pbrg_mj.perception.points.face_track import TRACK
from pbrg_mj.perception.points.memory import no_points
from pbrg_mj.perception.points.range_flow import empty_flow
from pbrg_mj.perception.track.world_frame import ScanPose
from tests.perceiving import box
from tests.seeing_points import estimator, sensor
from tests.test_perception_motion import seen, sideways, times


def test_what_moves_goes_on_where_no_beam_tells_of_it_and_nothing_else_does():
    """Three points of a thing at 0.3 m/s, one of what rests; the first two are nearer than 0.15 m."""
    parameters, points = estimator(sensor("lidar"))[0].parameters, no_points(1, 4)[0]
    points["x"], points["vx"], points["live"] = [0.12, 0.1, 0.3, 0.12], [0.3, 0.3, 0.3, 0.0], [True, False, True, True]
    predict_blind_zone_points(points, ScanPose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.2), parameters)
    np.testing.assert_allclose(points["x"], [0.12 + 0.2 * 0.3, 0.1, 0.3, 0.12], rtol=1e-6)


@pytest.mark.parametrize(
    ("x", "vx", "moves"), [(0.2, -0.027, True), (0.2, 0.027, False), (0.2, -0.02, False), (0.5, -0.027, False)]
)
def test_what_comes_slowly_and_is_about_to_vanish_is_taken_to_move(x: float, vx: float, moves: bool):
    """At 2.7 deviations, not away, not at 2, and not farther off, where later scans tell."""
    parameters, track = estimator(sensor("lidar"))[0].parameters, np.zeros(1, TRACK)
    track["x"], track["vx"], track["live"], track["time"] = x, vx, True, 1.0
    track["cxx"], track["cyy"] = 0.01**2, 0.01**2
    pose = ScanPose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.2)
    assign_velocities(no_points(1, 4)[0], 1, (empty_flow(0), 0), track, pose, parameters)
    assert track["moves"][0] == moves


@pytest.mark.parametrize(("preset", "far"), [("default", 0.01), ("lidar", 0.09)])
def test_hand_points_stay_so_far_that_beams_tell_of_all_that_comes(preset: str, far: float):
    """Those of a robot turned away from it: its beams are 4 cm nearer than its hand point, which keeps 10 cm."""
    assert blind_zone_margin(estimator(sensor(preset))[0].parameters) == pytest.approx(far)


def kept_off(preset: str, seed: int, width: float, speed: tuple[float, float]) -> list[float]:
    """How far behind half-spaces the nearest place of a box is, once no beam tells of it [m].

    Its face ends 0.1 m before the middle of a robot at rest; `speed` is towards it and across [m/s].
    """
    time, kept = times(preset, 3.0), []
    left = time[-1] - time
    places = [(0.1 + 0.5 * width + speed[0] * until, 0.25 - speed[1] * until) for until in left.tolist()]
    scenes = [box(x, y, width) for x, y in places]
    for (x, y), known in zip(places, seen(preset, seed, scenes, sideways(time, 0.0)), strict=True):
        if x - 0.5 * width < 0.15 and abs(y) < 0.5 * width:
            nearest = np.array([x - 0.5 * width, 0.0])
            kept.append(np.max((known.G[0] @ nearest - known.h[0])[known.active[0]]))
    return kept


def test_a_box_that_slides_by_nearer_than_beams_tell_is_kept_off_where_it_is():
    """Beams see parts of its face, and its other side; without its hidden points it is 5 cm too near."""
    kept = [one for seed in range(6) for one in kept_off("lidar", seed, 0.3, (0.0, 0.25))]
    assert len(kept) > 50
    assert min(kept) > 0.1


@pytest.mark.parametrize("preset", ["lidar", "lds_02"])
def test_a_box_that_comes_is_kept_as_far_off_as_beams_tell(preset: str):
    kept = [one for seed in range(4) for one in kept_off(preset, seed, 0.7, (0.1, 0.25))]
    assert len(kept) > 10
    assert min(kept) > 0.1 + blind_zone_margin(estimator(sensor(preset))[0].parameters)
