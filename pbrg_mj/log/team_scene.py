"""What moves, as a viewer draws it: robots, half-spaces, references, boxes on the move.

Every message holds all entities under the same names, so that each replaces the one before and a viewer that jumps
in time needs no other.
"""

from __future__ import annotations

import numpy as np
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from pbrg_mj.log import drawing
from pbrg_mj.log.payload import stamp
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.surroundings import MovingBox
from pbrg_mj.world.obstacles import box_centre
from pbrg_mj.world.robot import RobotModel

NAMES = ("half_spaces", "references", "moving_boxes")
LINE_REACH = 1.0  # of a half-space's line to either side of the point nearest to its robot [m]
LINE_HEIGHT = 0.02  # above the floor [m]
LINE_WIDTH = 2.0  # [pixel]
BALL = 0.04  # diameter of governed references [m]
OPERATOR_BALL = 0.08  # of r [m]
OPTIMUM_BALL = 0.06  # of m* [m]
HOVER = 0.05  # of references above the floor [m]
PLATE = 0.04  # height of the drawn robot [m]


def robots(message: SceneUpdate, model: RobotModel, count: int) -> None:
    """Add `count` robots, each fixed to its own frame: the viewer moves them with /tf."""
    for robot in range(count):
        entity = message.entities.add(frame_id=frame_of(robot + 1), id=frame_of(robot + 1), frame_locked=True)
        diameter, nose = 2 * model.body_radius, model.body_radius / 2
        drawing.disc(entity, (0.0, 0.0, PLATE / 2), (diameter, diameter, PLATE), drawing.robot_color(robot))
        drawing.box(entity, (nose, 0.0, PLATE), 0.0, (model.body_radius, 0.01, 0.004), drawing.NOSE_COLOR)


def frame_of(robot: int) -> str:
    """Return the name of robot `robot`'s body frame, counted from 1."""
    return f"robot_{robot}"


def team(record: TickRecord, optimum: np.ndarray, boxes: tuple[MovingBox, ...], time_ns: int) -> bytes:
    """Return a SceneUpdate of a tick; `optimum` (2,) [m] is the latest m*. What is not finite is left out."""
    message = SceneUpdate()
    lines, points, moving = (message.entities.add(frame_id="world", id=name) for name in NAMES)
    for entity in (lines, points, moving):
        stamp(entity, time_ns)
    for robot, hand in enumerate(record.hand_world):
        ends = line_ends(record.half_spaces, robot, hand)
        drawing.segments(lines, [(*end, LINE_HEIGHT) for end in ends], LINE_WIDTH, drawing.robot_color(robot))
    balls = [(m, BALL, drawing.robot_color(robot)) for robot, m in enumerate(record.solution.m)]
    balls += [
        (record.problem.reference, OPERATOR_BALL, drawing.OPERATOR_COLOR),
        (optimum, OPTIMUM_BALL, drawing.OPTIMUM_COLOR),
    ]
    for point, diameter, color in balls:
        if np.isfinite(point).all():
            drawing.ball(points, (*point.tolist(), HOVER), diameter, color)
    for box in boxes:
        x, y = box_centre(box, record.time).tolist()
        drawing.box(moving, (x, y, box.height / 2), 0.0, (*box.size, box.height), drawing.MOVING_COLOR)
    return message.SerializeToString(deterministic=True)


def line_ends(half_spaces: HalfSpaces, robot: int, hand: np.ndarray) -> list[list[float]]:
    """Return the ends (2 S, 2) [m] of the lines G q = h of a robot's half-spaces, near its hand point (2,) [m]."""
    active = half_spaces.active[robot]
    G, h = half_spaces.G[robot, active], half_spaces.h[robot, active]
    if not (np.isfinite(hand).all() and np.isfinite(G).all() and np.isfinite(h).all()):
        return []
    foot = hand + (h - G @ hand)[:, None] * G
    along = LINE_REACH * np.stack([-G[:, 1], G[:, 0]], axis=1)
    return np.stack([foot - along, foot + along], axis=1).reshape(-1, 2).tolist()


def points(positions: np.ndarray, time_ns: int) -> bytes:
    """Return PosesInFrame in the world of positions (n, 2) [m], all of them, in the robots' order."""
    message = PosesInFrame(frame_id="world")
    stamp(message, time_ns)
    for x, y in positions.tolist():
        pose = message.poses.add()
        pose.position.x, pose.position.y, pose.orientation.w = x, y, 1.0
    return message.SerializeToString(deterministic=True)
