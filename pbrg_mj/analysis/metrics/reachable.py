"""Whether a robot could have kept off a moving box, by the set of places that it could reach.

A contact counts as unavoidable only when it is shown that no motion of the robot alone avoids it. A robot's body, a
disc, starts where it was when the box first came into its sight and moves in any direction at its motors' no-load
speed. Its reachable set is carried on in time, less what the box, where it is then, and all that stands still cover
(forward reachability: Fisac, Chen, Tomlin and Sastry, HSCC 2015). The set is kept on a grid and rounded outwards: cells
that are covered or reached in part count as free and as reached. Where it becomes empty, no motion avoids the contact.
All else is avoidable: other robots, inertia and the time to react are left out, and who comes `REACH` away has escaped.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from pbrg_mj.scenario.robots import robot_size
from pbrg_mj.scenario.schema import MovingBox, Scenario
from pbrg_mj.world.scene.footprints import wall_margin, world_footprints
from pbrg_mj.world.scene.obstacles import box_centre, moving_footprints

STEP = 0.1  # [s] between sets at most, and between places at which is asked what is in sight
CELL = 0.01  # [m] of the grid
REACH = 1.2  # [m] from the start to the grid's edge
CORNER = CELL / math.sqrt(2.0)  # [m] from a cell's middle to its corner
OUTLINE = 9  # points along each side of a box that are looked for


def avoidable(scenario: Scenario, box: MovingBox, samples: tuple[np.ndarray, np.ndarray], contact: float) -> bool:
    """Return whether a robot that a box touches at the time `contact` [s] could have kept off it to the last sample.

    `samples` are times (S,) [s] and the robot's true hand points (S, 2) [m].
    """
    time, hand = samples
    seen = next(
        (k for k in range(len(time)) if time[k] < contact and is_visible(scenario, box, time[k], hand[k])), None
    )
    if seen is None:
        return False
    start = max(seen - 1, 0)  # between the two samples it came into sight
    return can_escape(scenario, box, time[start:], hand[start])


def is_visible(scenario: Scenario, box: MovingBox, time: float, hand: np.ndarray) -> bool:
    """Return whether some point of a box's outline is within range of a hand point (2,) [m], and nothing between them.

    Robots do not count as in the way, nor gaps between beams.
    """
    shown, size = moving_footprints((box,), time), robot_size(scenario.robot)
    along = np.linspace(-1.0, 1.0, OUTLINE)
    edge, side = np.ones(OUTLINE), shown.half_size[0]
    sides = [(along, edge), (along, -edge), (edge, along), (-edge, along)]
    outline = shown.centre[0] + side * np.concatenate([np.column_stack(one) for one in sides])
    far = np.linalg.norm(outline - hand, axis=1)
    outline = outline[far <= scenario.sensors.beams.range_max + size.hand_offset]
    walls = world_footprints(scenario.world)
    if not len(outline) or not (len(walls.centre) or len(walls.first) > 1):
        return len(outline) > 0
    steps = np.linspace(0.0, 1.0, 2 + int(far.max() / CELL))
    ways = hand + steps[:, None] * (outline - hand)[:, None]
    blocked = wall_margin(ways.reshape(-1, 2), walls, 0.0).reshape(len(outline), -1).min(axis=1) < 0.0
    return not blocked.all()


def can_escape(scenario: Scenario, box: MovingBox, time: np.ndarray, hand: np.ndarray) -> bool:
    """Return whether the reachable set of a robot whose hand point (2,) is there at time[0] is not empty at the end."""
    from scipy.ndimage import distance_transform_edt  # half a second that metrics of most runs do without

    size, count = robot_size(scenario.robot), math.ceil(REACH / CELL)
    axis = CELL * np.arange(-count, count + 1)
    x, y = np.meshgrid(hand[0] + axis, hand[1] + axis, indexing="ij")
    cells = np.column_stack([x.ravel(), y.ravel()])
    standing = wall_margin(cells, world_footprints(scenario.world), size.body_radius - CORNER) > 0.0
    reached = np.hypot(*(cells - hand).T) <= size.hand_offset + CORNER
    speed, known = top_speed(scenario), sample_times(box, time, size.body_radius)
    for before, now in pairwise(known):
        far = CELL * np.asarray(distance_transform_edt(~reached.reshape(x.shape))).ravel()
        free = wall_margin(cells, moving_footprints((box,), now), size.body_radius - CORNER) > 0.0
        reached = (far <= speed * (now - before) + 2 * CORNER) & standing & free
        square = reached.reshape(x.shape)
        if square[0].any() or square[-1].any() or square[:, 0].any() or square[:, -1].any():
            return True
        if not reached.any():
            return False
    return True


def sample_times(box: MovingBox, time: np.ndarray, body_radius: float) -> list[float]:
    """Return the times (S,) [s] and others between them, so that a box does not jump over a body."""
    moves = [np.linalg.norm(box_centre(box, now) - box_centre(box, before)) for before, now in pairwise(time.tolist())]
    parts = [max(1, math.ceil(one / (body_radius + 0.5 * min(box.size)))) for one in moves]
    inner = [np.linspace(*ends, count, endpoint=False) for ends, count in zip(pairwise(time), parts, strict=True)]
    return np.concatenate([*inner, time[-1:]]).tolist()


def top_speed(scenario: Scenario) -> float:
    """Return the largest speed of a body's centre in any direction [m/s], without load or friction."""
    from pbrg_mj.world.scene.robot import load_robot_model  # MuJoCo, which metrics of most runs do not need

    robot = load_robot_model(scenario.robot)
    return robot.top_speed * (math.sqrt(2.0) if robot.omnidirectional else 1.0)
