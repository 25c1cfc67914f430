"""With what each robot was in contact since the last tick, told apart, from the counters of the model."""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.world.scene.contact_counters import MOVING, SKIRT, WALLS

UPRIGHT = math.cos(math.radians(8.0))  # of a body tilted by less, the skirt's rim, 10 mm up, is off the floor
NEAR = 3.0  # body radii between the centres of robots that may touch although one of them has tipped over


@kernel
def write_contacts(arrays, index, numbers, truth):
    """Write with what each robot was in contact at this step, or at those within the tick before.

    `arrays` are MujocoArrays, `index` is a TruthIndex, `numbers` are body_radius [m] and how many boxes move,
    moving_boxes; of `truth` the poses are there and the contacts are written.
    """
    body_radius, moving_boxes = numbers
    ground = MOVING + moving_boxes
    counters, steps = index.contacts.shape[1], index.earlier_contacts.shape[2]
    for j in range(len(index.body)):
        wall = moving = robot = False
        for step in range(-1, steps):  # -1: now
            boxes = 0.0
            for k in range(MOVING, ground):
                boxes += _count(arrays, index, j, k, step)
            below = _count(arrays, index, j, ground, step) if ground < counters else 0.0
            walls = _count(arrays, index, j, WALLS, step)
            wall |= walls > 0.0
            moving |= boxes > 0.0
            robot |= _count(arrays, index, j, SKIRT, step) > walls + boxes + below
        truth.wall_contact[j], truth.moving_contact[j] = wall, moving
        truth.robot_contact[j] = robot and _may_meet(arrays, index, truth.body_pose, NEAR * body_radius, j)


@kernel
def _count(arrays, index, j, k, step):
    if step < 0:
        return arrays.sensordata[index.contacts[j, k]]
    return arrays.history[index.earlier_contacts[j, k, step]]


@kernel
def _may_meet(arrays, index, pose, near, j):
    """Whether it is no floor that the skirt touches: the robot is upright, or another one is near.

    pose (n, 3) is x, y, heading [m], [rad]; `near` [m].
    """
    if arrays.xmat[index.body[j], 8] > UPRIGHT:
        return True
    for other in range(len(pose)):
        if other != j and math.hypot(pose[other, 0] - pose[j, 0], pose[other, 1] - pose[j, 1]) < near:
            return True
    return False
