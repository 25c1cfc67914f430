"""What moves, as a viewer draws it: robots, half-spaces, references, boxes on the move.

Every message holds all entities under the same names, so that each replaces the one before and a viewer that jumps
in time needs no other.
"""

from __future__ import annotations

import math
from itertools import chain, compress
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from pbrg_mj.kernel import kernel
from pbrg_mj.log.scene.static import primitives as drawing
from pbrg_mj.log.schema.message import stamp
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import MovingBox
from pbrg_mj.world.scene.obstacles import box_centre
from pbrg_mj.world.scene.robot import RobotModel

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


class TeamScene:
    """Draws a tick's SceneUpdate. Keeps the message while as much is to be seen, and moves only what moves in it."""

    def __init__(self, boxes: tuple[MovingBox, ...]):
        self._boxes = boxes
        self._seen: tuple[list[int], list[bool]] | None = None
        self._message = SceneUpdate()
        self._movable: list[Any] = []  # positions in the message: ends of lines, balls, boxes

    def draw(self, record: TickRecord, optimum: np.ndarray, time_ns: int) -> bytes:
        """Return a tick's SceneUpdate; `optimum` (2,) [m] is the latest m*. What is not finite is left out."""
        counts, ends = line_ends(record.half_spaces, record.hand_world)
        balls = [*record.solution.m.tolist(), record.problem.reference.tolist(), optimum.tolist()]
        visible = [math.isfinite(x) and math.isfinite(y) for x, y in balls]
        seen = (counts, visible)
        if seen != self._seen:
            self._start(*seen)
            self._seen = seen
        centres = [box_centre(box, record.time).tolist() for box in self._boxes]
        for place, (x, y) in zip(self._movable, chain(ends, compress(balls, visible), centres), strict=True):
            place.x, place.y = x, y
        for entity in self._message.entities:
            stamp(entity, time_ns)
        return self._message.SerializeToString(deterministic=True)

    def _start(self, ends: list[int], visible: list[bool]) -> None:
        """Begin a message with so many line ends of each robot and with the balls that are `visible`, anywhere yet."""
        self._message = SceneUpdate()
        lines, points, moving = (self._message.entities.add(frame_id="world", id=name) for name in NAMES)
        for robot, count in enumerate(ends):
            drawing.segments(lines, [(0.0, 0.0, LINE_HEIGHT)] * count, LINE_WIDTH, drawing.robot_color(robot))
        balls = [(BALL, drawing.robot_color(robot)) for robot in range(len(ends))]
        balls += [(OPERATOR_BALL, drawing.OPERATOR_COLOR), (OPTIMUM_BALL, drawing.OPTIMUM_COLOR)]
        for diameter, color in compress(balls, visible):
            drawing.ball(points, (0.0, 0.0, HOVER), diameter, color)
        for box in self._boxes:
            drawing.box(moving, (0.0, 0.0, box.height / 2), 0.0, (*box.size, box.height), drawing.MOVING_COLOR)
        self._movable = [end for line in lines.lines for end in line.points]
        self._movable += [solid.pose.position for solid in (*points.spheres, *moving.cubes)]


def line_ends(half_spaces: HalfSpaces, hand_world: np.ndarray) -> tuple[list[int], list[list[float]]]:
    """Return how many ends the robots' lines G q = h have, robot after robot, and the ends x, y [m] of all of them.

    Lines reach to either side of the point nearest to the robot's hand point, `hand_world` (n, 2) [m]. A robot has
    none when any of its numbers is not finite.
    """
    counts, ends = _line_ends(half_spaces.G, half_spaces.h, half_spaces.active, hand_world)
    return counts.tolist(), ends.tolist()


@kernel
def _line_ends(G, h, active, hand):  # pragma: no cover - compiled
    counts, ends, total = np.zeros(len(h), dtype=np.int64), np.empty((2 * h.size, 2)), 0
    for j in range(len(h)):
        x, y = hand[j, 0], hand[j, 1]
        sound, first = math.isfinite(x) and math.isfinite(y), total
        for k in range(h.shape[1]):
            if active[j, k]:
                gx, gy, gap = G[j, k, 0], G[j, k, 1], h[j, k] - (G[j, k, 0] * x + G[j, k, 1] * y)
                sound = sound and math.isfinite(gx) and math.isfinite(gy) and math.isfinite(h[j, k])
                for side in (-1.0, 1.0):
                    ends[total, 0] = x + gap * gx - side * LINE_REACH * gy
                    ends[total, 1] = y + gap * gy + side * LINE_REACH * gx
                    total += 1
        if not sound:
            total = first
        counts[j] = total - first
    return counts, ends[:total].copy()


class Points:
    """PosesInFrame in the world of `count` points without a heading, all of them, in the robots' order."""

    def __init__(self, count: int):
        self._message = PosesInFrame(frame_id="world")
        for _ in range(count):
            self._message.poses.add().orientation.w = 1.0
        self._places = [pose.position for pose in self._message.poses]

    def draw(self, positions: np.ndarray, time_ns: int) -> bytes:
        """Return the message; `positions` (count, 2) [m]."""
        stamp(self._message, time_ns)
        for place, (x, y) in zip(self._places, positions.tolist(), strict=True):
            place.x, place.y = x, y
        return self._message.SerializeToString(deterministic=True)
