"""How far what comes reaches to either side: the ends of what is seen are within what is told, which is little more."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.points.beams import SeenBeams
from pbrg_mj.perception.points.detect import add_scan
from pbrg_mj.perception.points.face_span import face_span
from pbrg_mj.perception.points.memory import no_points
from pbrg_mj.perception.points.past_scan import PAST_ECHO, PAST_POSE
from pbrg_mj.perception.track.world_frame import ScanPose
from tests.perceiving import box, together
from tests.raycast import Scene, cast
from tests.seeing_points import estimator, sensor
from tests.test_perception_motion import seen, sideways, times

AT_REST = ScanPose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
SENSORS = ["default", "lidar", "tof_ring", "robotarium", "lds_02"]
SIDES = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])


def visible_part(width: float, angle: float, center: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return points along the sides of a box that face the origin, and which are seen at up to 60 deg of incidence."""
    turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    along = np.linspace(-0.5, 0.5, 401)[:, None] * width
    sides, square = [], []
    for n in SIDES:
        side = center + (0.5 * width * n + along * n[::-1]) @ turned.T
        cosines = -(side @ (turned @ n)) / np.linalg.norm(side, axis=1)
        if cosines[200] > 0.0:
            sides.append(side)
            square.append(cosines > 0.5)
    return np.concatenate(sides), np.concatenate(square)


def told(preset: str, scene: Scene, place: np.ndarray, normal: np.ndarray) -> tuple[float, float]:
    """Return the span of the face at a place, by exact ranges of a robot at the origin."""
    made, given = estimator(sensor(preset))
    parameters, reach = made.parameters, given.sensors.beams.range_max
    ranges = cast(scene, np.zeros(3), given.sensors.beams.count, reach)
    ranges[ranges < given.sensors.beams.range_min] = np.nan
    before = np.zeros((parameters.lag, len(ranges)), PAST_ECHO), np.zeros(parameters.lag, PAST_POSE)
    read, team = SeenBeams(ranges, parameters.directions), (np.full((1, 1, 2), 9.0), 0)
    echoes = add_scan(no_points(1, 2 * len(ranges))[0], 1, read, AT_REST, team, before, parameters)
    return face_span((echoes, read), (normal[0], normal[1]), (place[0], place[1]), AT_REST, parameters)


@pytest.mark.parametrize("preset", SENSORS)
def test_the_ends_of_a_box_are_within_its_span_which_is_little_more(preset: str) -> None:
    """Boxes at any angle and bearing, in every other scene with a wall 0.8 m behind.

    Where no echo binds, as of 24 beams one or two do not at first, nothing is known of the ends.
    """
    rng, parameters = np.random.default_rng(511), estimator(sensor(preset))[0].parameters
    unknown = 0
    for number in range(60):
        width, angle, bearing = rng.uniform(0.3, 0.8), rng.uniform(-np.pi, np.pi), rng.uniform(-np.pi, np.pi)
        u = np.array([np.cos(bearing), np.sin(bearing)])
        center = rng.uniform(0.8, 1.0) * u
        (part, square), scene = visible_part(width, angle, center), box(*center, width, angle=angle)
        if number % 2:
            across = 1.5 * np.array([-u[1], u[0]])
            scene = together(scene, Scene(((*(2.4 * u - across), *(2.4 * u + across)),)))
        far = np.linalg.norm(part, axis=1)
        place, normal = part[far.argmin()], part[far.argmin()] / far.min()
        low, high = told(preset, scene, place, normal)
        if np.isinf([low, high]).all():
            unknown += 1
            continue
        ends = part @ [-normal[1], normal[0]]
        most = parameters.clearance + 1.05 * parameters.joining[0] * far.max()
        assert ends.min() - most <= low <= ends[square].min() - parameters.clearance + 1e-9
        assert ends[square].max() + parameters.clearance - 1e-9 <= high <= ends.max() + most
    assert unknown < (40 if preset == "tof_ring" else 1)


@pytest.mark.parametrize("preset", ["default", "lidar", "robotarium"])
def test_a_box_that_comes_has_the_span_of_what_is_seen_of_it(preset: str) -> None:
    """With noise, from the estimator, and a wall behind the box. Noise of 3 % of the range hides one end of sixteen."""
    rng, time, told_of, short = np.random.default_rng(512), times(preset, 1.6), 0, 0
    for seed in range(8):
        width, speed, start = rng.uniform(0.3, 0.6), rng.uniform(0.2, 0.35), rng.uniform(-0.2, 0.2)
        behind = Scene(((2.2, -2.0, 2.2, 2.0),))
        scenes = [together(box(0.85 + speed * left, start, width), behind) for left in time[-1] - time]
        *_, known = seen(preset, seed, scenes, sideways(time, 0.0))
        ahead = int(np.argmax(np.where(known.closing_speeds[0] > 0.1, known.G[0, :, 0], -1.0)))
        if known.closing_speeds[0, ahead] > 0.1 and known.G[0, ahead, 0] > 0.95:
            parameters, told_of = estimator(sensor(preset))[0].parameters, told_of + 1
            T = np.array([-known.G[0, ahead, 1], known.G[0, ahead, 0]])
            ends = np.array([[0.85 - width / 2, start - width / 2], [0.85 - width / 2, start + width / 2]]) @ T
            most = parameters.clearance + 1.1 * parameters.joining[0] + 0.03
            low, high = known.face_spans[0, ahead]
            assert ends.min() - most < low < ends.min()
            assert ends.max() < high < ends.max() + most
            short += low > ends.min() - parameters.clearance + 0.03
            short += high < ends.max() + parameters.clearance - 0.03
    assert told_of >= 6
    assert short <= (preset == "robotarium")


@pytest.mark.parametrize("preset", ["lidar", "lds_02"])
@pytest.mark.parametrize("right", [-0.2, -0.05])
def test_what_is_nearer_than_beams_tell_goes_on_there(preset: str, right: float) -> None:
    """A face 0.13 m ahead: its middle, or its right end, is nearer than beams tell. It ends no farther than they do."""
    parameters = estimator(sensor(preset))[0].parameters
    place, normal = np.array([0.13, 0.15]), np.array([1.0, 0.0])
    low, high = told(preset, Scene(((0.13, right, 0.13, 0.2),)), place, normal)
    chord, gap = np.sqrt(parameters.range_min**2 - 0.13**2), 1.05 * parameters.joining[0]
    assert min(right, -chord) - gap * np.hypot(0.13, 0.2) < low + parameters.clearance < right
    assert 0.2 < high - parameters.clearance < 0.2 + gap * np.hypot(0.13, 0.2)
