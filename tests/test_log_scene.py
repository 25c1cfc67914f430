"""What viewers get to see of obstacles and working areas, decoded."""

import numpy as np
import pytest
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from pbrg_mj.log import scene
from tests.worlds import scenario

AROUND = {
    "boxes": [{"center": (2.0, 1.0), "size": (1.0, 0.5), "angle_deg": 30.0, "height": 0.3}],
    "patches": [{"from": (1.0, 4.0), "to": (-1.0, 3.0)}],
    "moving_boxes": [
        {"size": (0.4, 0.2), "stops": [{"time": 0, "center": (-3.0, 0.0)}, {"time": 1, "center": (-3.0, -2.0)}]}
    ],
}


def drawn(**sections: object) -> dict[str, list]:
    message = SceneUpdate.FromString(scene.floor_plan(scenario(**sections)))
    return {entity.id: list(entity.cubes) for entity in message.entities if entity.frame_id == "world"}


def numbers(cube) -> list[float]:
    """Return middle, size and heading."""
    vectors = [getattr(vector, axis) for vector in (cube.pose.position, cube.size) for axis in "xyz"]
    return [*vectors, 2 * np.arctan2(cube.pose.orientation.z, cube.pose.orientation.w)]


def test_boxes_patches_and_stops_are_drawn_where_they_are() -> None:
    found = drawn(world=AROUND)
    assert list(found) == ["floor", "walls", "boxes", "patches", "stops"]
    assert numbers(found["boxes"][0]) == pytest.approx([2.0, 1.0, 0.15, 1.0, 0.5, 0.3, np.pi / 6])
    assert numbers(found["patches"][0]) == pytest.approx([0.0, 3.5, 0.001, 2.0, 1.0, 0.002, 0.0])
    assert [numbers(stop)[:5] for stop in found["stops"]] == [
        pytest.approx([-3.0, 0.0, 0.001, 0.4, 0.2]),
        pytest.approx([-3.0, -2.0, 0.001, 0.4, 0.2]),
    ]


def test_the_floor_reaches_a_metre_beyond_everything() -> None:
    carries = [{"robot": 1, "time": 1, "to": (0.0, -7.0)}]
    floor = numbers(drawn(world=AROUND, disturbances={"carries": carries})["floor"][0])
    low, high = (np.array(floor[:2]) + sign * np.array(floor[3:5]) / 2 for sign in (-1, 1))
    assert low[1] == pytest.approx(-8.0)
    assert high[1] == pytest.approx(4.5, abs=0.51)  # the patch's far end, and its half width at most
    assert low[0] <= -4.0 and high[0] >= 3.0


def test_what_is_not_there_is_not_drawn() -> None:
    assert list(drawn()) == ["floor", "walls"]


def test_a_scan_says_where_its_first_and_last_beam_point() -> None:
    angles = np.deg2rad([-30.0, 0.0, 30.0])
    message = LaserScan.FromString(scene.scan(2, np.array([1.0, np.nan, 2.0]), angles, 5_000_000_000))
    assert (message.start_angle, message.end_angle) == (angles[0], angles[2])
    assert message.frame_id == "robot_2"
    assert message.timestamp.seconds == 5
