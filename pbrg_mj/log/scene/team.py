"""What moves, as a viewer draws it: half-spaces, references, moving boxes.

Every message holds all entities under the same names, so that each replaces the one before and a viewer that jumps
in time needs no other.
"""

from __future__ import annotations

import math
from itertools import chain, compress
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from pbrg_mj.kernel import kernel
from pbrg_mj.log.scene import primitives
from pbrg_mj.log.schema.message import set_timestamp
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import MovingBox
from pbrg_mj.world.scene.obstacles import box_centre

ENTITIES = ("half_spaces", "references", "moving_boxes")
LINE_REACH = 1.0  # of a half-space's line to either side of the point nearest to its robot [m]
LINE_HEIGHT = 0.02  # above the floor [m]
LINE_WIDTH = 2.0  # [pixel]
GOVERNED_DIAMETER = 0.04  # of the spheres at governed references [m]
REFERENCE_DIAMETER = 0.08  # at r [m]
OPTIMUM_DIAMETER = 0.06  # at m* [m]
REFERENCE_HEIGHT = 0.05  # of the spheres above the floor [m]


class TeamScene:
    """Draws a tick's SceneUpdate. Keeps the message while the same things are visible, and moves them."""

    def __init__(self, boxes: tuple[MovingBox, ...]):
        self._boxes = boxes
        self._visible: tuple[list[int], list[bool]] | None = None
        self._message = SceneUpdate()
        self._positions: list[Any] = []  # positions in the message: ends of lines, spheres, boxes

    def serialize(self, record: TickRecord, optimum: np.ndarray, time_ns: int) -> bytes:
        """Return a tick's SceneUpdate; `optimum` (2,) [m] is the latest m*. What is not finite is left out."""
        counts, ends = line_ends(record.half_spaces, record.hand_world)
        spheres = [*record.solution.m.tolist(), record.problem.reference.tolist(), optimum.tolist()]
        visible = [math.isfinite(x) and math.isfinite(y) for x, y in spheres]
        entities = (counts, visible)
        if entities != self._visible:
            self._new_message(*entities)
            self._visible = entities
        centres = [box_centre(box, record.time).tolist() for box in self._boxes]
        for position, (x, y) in zip(self._positions, chain(ends, compress(spheres, visible), centres), strict=True):
            position.x, position.y = x, y
        for entity in self._message.entities:
            set_timestamp(entity, time_ns)
        return self._message.SerializeToString(deterministic=True)

    def _new_message(self, ends: list[int], visible: list[bool]) -> None:
        """Begin a message with `ends` line ends per robot and the `visible` spheres; their positions come later."""
        self._message = SceneUpdate()
        lines, references, moving = (self._message.entities.add(frame_id="world", id=name) for name in ENTITIES)
        for robot, count in enumerate(ends):
            primitives.add_line_segments(
                lines, [(0.0, 0.0, LINE_HEIGHT)] * count, LINE_WIDTH, primitives.robot_color(robot)
            )
        spheres = [(GOVERNED_DIAMETER, primitives.robot_color(robot)) for robot in range(len(ends))]
        spheres += [(REFERENCE_DIAMETER, primitives.REFERENCE_COLOR), (OPTIMUM_DIAMETER, primitives.OPTIMUM_COLOR)]
        for diameter, color in compress(spheres, visible):
            primitives.add_sphere(references, (0.0, 0.0, REFERENCE_HEIGHT), diameter, color)
        for box in self._boxes:
            primitives.add_box(
                moving, (0.0, 0.0, box.height / 2), 0.0, (*box.size, box.height), primitives.MOVING_COLOR
            )
        self._positions = [end for line in lines.lines for end in line.points]
        self._positions += [solid.pose.position for solid in (*references.spheres, *moving.cubes)]


def line_ends(half_spaces: HalfSpaces, hand_world: np.ndarray) -> tuple[list[int], list[list[float]]]:
    """Return how many ends the robots' lines G q = h have, robot after robot, and the ends x, y [m] of all of them.

    Lines reach to either side of the point nearest to the robot's hand point, `hand_world` (n, 2) [m]. A robot has
    none when any of its numbers is not finite.
    """
    counts, ends = _line_ends(half_spaces.G, half_spaces.h, half_spaces.active, hand_world)
    return counts.tolist(), ends.tolist()


@kernel
def _line_ends(G, h, active, hand):
    """Return how many ends each robot has (n,), and all of them (ends, 2) [m].

    Arguments: G (n, K, 2), h (n, K), active (n, K) of HalfSpaces, hand (n, 2) [m].
    """
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
