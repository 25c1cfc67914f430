"""What viewers get to see of obstacles and working areas, decoded."""

from math import cos, sin

import numpy as np
import pytest
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from pbrg_mj.log.scene.messages import PointsMessage, ScanMessage, TransformsMessage
from pbrg_mj.log.scene.static import static_scene
from pbrg_mj.log.schema.message import set_timestamp
from tests.worlds import scenario

AROUND = {
    "boxes": [{"center": (2.0, 1.0), "size": (1.0, 0.5), "angle_deg": 30.0, "height": 0.3}],
    "patches": [{"from": (1.0, 4.0), "to": (-1.0, 3.0)}],
    "moving_boxes": [
        {"size": (0.4, 0.2), "waypoints": [{"time": 0, "center": (-3.0, 0.0)}, {"time": 1, "center": (-3.0, -2.0)}]}
    ],
}


def drawn(**sections: object) -> dict[str, list]:
    message = SceneUpdate.FromString(static_scene(scenario(**sections)))
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
    floor = numbers(drawn(world=AROUND, disturbances={"kidnappings": carries})["floor"][0])
    low, high = (np.array(floor[:2]) + sign * np.array(floor[3:5]) / 2 for sign in (-1, 1))
    assert low[1] == pytest.approx(-8.0)
    assert high[1] == pytest.approx(4.5, abs=0.51)  # the patch's far end, and its half width at most
    assert low[0] <= -4.0 and high[0] >= 3.0


def test_what_is_not_there_is_not_drawn() -> None:
    assert list(drawn()) == ["floor", "walls"]


def test_a_scan_says_where_its_first_and_last_beam_point() -> None:
    angles = np.deg2rad([-30.0, 0.0, 30.0])
    message = LaserScan.FromString(ScanMessage(2, angles).serialize(np.array([1.0, np.nan, 2.0]), 5_000_000_000))
    assert (message.start_angle, message.end_angle) == (angles[0], angles[2])
    assert message.frame_id == "robot_2"
    assert message.timestamp.seconds == 5


ODD = np.array([0.0, -0.0, np.nan, np.inf, 1e-300, 2.5])
TIMES = [0, 1_500_000_000, 2_000_000_000, 7]


def values(*shape: int) -> list[np.ndarray]:
    """Numbers of every kind, a set for each of TIMES."""
    rng = np.random.default_rng(3)
    return [rng.choice(ODD, shape) for _ in TIMES]


def test_kept_poses_are_those_drawn_afresh() -> None:
    kept = TransformsMessage(3)
    for time_ns, body_pose in zip(TIMES, values(3, 3), strict=True):
        body_pose[:, 2] = np.nan_to_num(body_pose[:, 2], posinf=1.0)
        message = FrameTransforms()
        for robot, (x, y, heading) in enumerate(body_pose.tolist(), start=1):
            one = message.transforms.add(parent_frame_id="world", child_frame_id=f"robot_{robot}")
            set_timestamp(one, time_ns)
            one.translation.x, one.translation.y = x, y
            one.rotation.z, one.rotation.w = sin(heading / 2), cos(heading / 2)
        assert kept.serialize(body_pose, time_ns) == message.SerializeToString(deterministic=True)


def test_kept_scans_are_those_drawn_afresh() -> None:
    angles = np.linspace(0.0, 3.0, 7)
    kept = ScanMessage(4, angles)
    for time_ns, ranges in zip(TIMES, values(7), strict=True):
        message = LaserScan(frame_id="robot_4", start_angle=0.0, end_angle=3.0, ranges=ranges.tolist())
        set_timestamp(message, time_ns)
        message.pose.orientation.w = 1.0
        assert kept.serialize(ranges, time_ns) == message.SerializeToString(deterministic=True)


def test_kept_points_are_those_drawn_afresh() -> None:
    kept = PointsMessage(5)
    for time_ns, positions in zip(TIMES, values(5, 2), strict=True):
        message = PosesInFrame(frame_id="world")
        set_timestamp(message, time_ns)
        for x, y in positions.tolist():
            pose = message.poses.add()
            pose.position.x, pose.position.y, pose.orientation.w = x, y, 1.0
        assert kept.serialize(positions, time_ns) == message.SerializeToString(deterministic=True)
