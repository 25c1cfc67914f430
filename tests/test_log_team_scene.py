"""The picture of the team against the same picture drawn afresh, primitive by primitive."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from pbrg_mj.log.scene import primitives, team
from pbrg_mj.log.scene.team import TeamScene, line_ends
from pbrg_mj.log.schema.message import set_timestamp
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import MovingBox
from pbrg_mj.world.scene.obstacles import box_centre
from tests.records import records

BOXES = tuple(
    MovingBox.model_validate(
        {
            "size": size,
            "height": 0.3,
            "waypoints": [{"time": 0, "center": (-1.0, 0.0)}, {"time": 1, "center": (1.0, 2.0)}],
        }
    )
    for size in ((0.4, 0.2), (0.1, 0.3))
)


def drawn_afresh(record: TickRecord, optimum: np.ndarray, boxes: tuple[MovingBox, ...], time_ns: int) -> bytes:
    message = SceneUpdate()
    lines, balls, moving = (message.entities.add(frame_id="world", id=name) for name in team.ENTITIES)
    for entity in message.entities:
        set_timestamp(entity, time_ns)
    counts, ends = line_ends(record.half_spaces, record.hand_world)
    rest = iter(ends)
    for robot, count in enumerate(counts):
        points = [(*end, team.LINE_HEIGHT) for end in islice(rest, count)]
        primitives.add_line_segments(lines, points, team.LINE_WIDTH, primitives.robot_color(robot))
    wanted = [(m, team.GOVERNED_DIAMETER, primitives.robot_color(robot)) for robot, m in enumerate(record.solution.m)]
    wanted += [
        (record.problem.reference, team.REFERENCE_DIAMETER, primitives.REFERENCE_COLOR),
        (optimum, team.OPTIMUM_DIAMETER, primitives.OPTIMUM_COLOR),
    ]
    for point, diameter, color in wanted:
        if np.isfinite(point).all():
            primitives.add_sphere(balls, (*point.tolist(), team.REFERENCE_HEIGHT), diameter, color)
    for box in boxes:
        middle = (*box_centre(box, record.time).tolist(), box.height / 2)
        primitives.add_box(moving, middle, 0.0, (*box.size, box.height), primitives.MOVING_COLOR)
    return message.SerializeToString(deterministic=True)


def told(seed: int, ticks: int = 40) -> list[tuple[TickRecord, np.ndarray]]:
    """Records and optima of which some are 0, -0 and not finite, so that what is to be seen changes."""
    rng = np.random.default_rng(seed)
    odd = np.array([0.0, -0.0, np.nan, np.inf])

    def some_odd(values: np.ndarray, share: float) -> np.ndarray:
        return np.where(rng.random(values.shape) < share, rng.choice(odd, values.shape), values)

    found = []
    for record in records(ticks, seed=seed):
        solution = replace(record.solution, m=some_odd(record.solution.m, 0.2))
        half_spaces = replace(record.half_spaces, h=some_odd(record.half_spaces.h, 0.1))
        hand = some_odd(rng.normal(size=record.hand_world.shape), 0.1)
        seen = record._replace(solution=solution, half_spaces=half_spaces, hand_world=hand)
        found.append((seen, some_odd(rng.normal(size=2), 0.2)))
    return found


@pytest.mark.parametrize("boxes", [(), BOXES], ids=["still", "boxes"])
@pytest.mark.parametrize("seed", range(3))
def test_what_is_kept_draws_as_afresh(seed: int, boxes: tuple[MovingBox, ...]) -> None:
    scene = TeamScene(boxes)
    for time_ns, (record, optimum) in enumerate(told(seed)):
        assert scene.serialize(record, optimum, time_ns) == drawn_afresh(record, optimum, boxes, time_ns)


def test_a_picture_does_not_depend_on_those_before() -> None:
    scene, ticks = TeamScene(BOXES), told(4)
    forward = [scene.serialize(record, optimum, 5) for record, optimum in ticks]
    assert [scene.serialize(record, optimum, 5) for record, optimum in reversed(ticks)] == forward[::-1]


def test_lines_are_where_the_half_spaces_end() -> None:
    rng = np.random.default_rng(5)
    turn = rng.uniform(0, 2 * np.pi, (2, 3))
    G = np.stack([np.cos(turn), np.sin(turn)], axis=2)
    active = np.array([[True, False, True], [False, False, False]])
    half_spaces = HalfSpaces(G, rng.normal(size=(2, 3)), active, np.ones((2, 3, 2), dtype=bool))
    hands = rng.normal(size=(2, 2))
    hand = hands[0]
    counts, ends = line_ends(half_spaces, hands)
    assert counts == [4, 0]
    for slot, pair in zip((0, 2), np.array(ends).reshape(2, 2, 2), strict=True):  # by end, by axis
        np.testing.assert_allclose(pair @ G[0, slot], half_spaces.h[0, slot], atol=1e-14)
        nearest = hand + (half_spaces.h[0, slot] - G[0, slot] @ hand) * G[0, slot]
        np.testing.assert_allclose(pair.mean(axis=0), nearest, atol=1e-14)
        np.testing.assert_allclose(np.linalg.norm(pair[1] - pair[0]), 2 * team.LINE_REACH)


@pytest.mark.parametrize("odd", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("what", ["hand", "G", "h"])
def test_lines_that_are_not_finite_are_left_out(what: str, odd: float) -> None:
    values = {"hand": np.ones((1, 2)), "G": np.full((1, 2, 2), 0.5), "h": np.ones((1, 2))}
    everyone = np.ones((1, 2, 1), dtype=bool)
    values[what].flat[-1] = odd
    for active, expected in (((True, True), 0), ((True, False), 0 if what == "hand" else 2)):
        half_spaces = HalfSpaces(values["G"], values["h"], np.array([active]), everyone)
        counts, ends = line_ends(half_spaces, values["hand"])
        assert counts == [expected] == [len(ends)]
