"""The true state, read from MuJoCo's arrays."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.world.plant.contacts import write_contacts
from pbrg_mj.world.plant.interface import Truth
from pbrg_mj.world.scene.footprints import Footprints, margin
from pbrg_mj.world.scene.model_index import ModelIndex


class MujocoArrays(NamedTuple):
    """Those arrays of MjData from which the truth is read; of a batch with one more axis in front."""

    xpos: np.ndarray  # (bodies, 3)
    xmat: np.ndarray  # (bodies, 9)
    site_xpos: np.ndarray  # (sites, 3)
    speed: np.ndarray  # qvel, or actuator_velocity of omnidirectional bases
    sensordata: np.ndarray
    history: np.ndarray


class TruthIndex(NamedTuple):
    """Where the n robots stand in these arrays: see ModelIndex."""

    body: np.ndarray  # (n,) in xpos and xmat
    hand: np.ndarray  # (n,) in site_xpos
    wheel_speed: np.ndarray  # (n, 2) in the array of speeds
    contacts: np.ndarray  # (n, c) in sensordata
    earlier_contacts: np.ndarray  # (n, c, s) in history


def mujoco_arrays(get: Callable[[str], np.ndarray], omnidirectional: bool) -> MujocoArrays:
    """Return the arrays by their names: views of MuJoCo's memory, which stay the same."""
    names = {"speed": "actuator_velocity" if omnidirectional else "qvel"}
    return MujocoArrays(*(get(names.get(field, field)) for field in MujocoArrays._fields))


def truth_index(index: ModelIndex) -> TruthIndex:
    """Return the part of the index that the truth needs."""
    return TruthIndex(*(getattr(index, name) for name in TruthIndex._fields))


def empty_truth(n: int) -> Truth:
    """Return a truth of n robots whose arrays are still to be written."""
    margins, contacts = [np.empty(n) for _ in range(2)], [np.empty(n, dtype=bool) for _ in range(3)]
    return Truth(
        np.empty((n, 3)), np.empty((n, 2)), np.empty((n, 2)), margins[0], contacts[0], margins[1], *contacts[1:]
    )


@kernel
def write_truth_of(arrays, index, obstacles, size, truth):
    """Call `write_truth` with plain tuples: handing over named ones from Python costs 20 us more.

    `obstacles` are the members of Footprints of walls and of moving boxes, `moving`.
    """
    walls, moving = obstacles
    obstacles = (Footprints(*walls), Footprints(*moving))
    write_truth(MujocoArrays(*arrays), TruthIndex(*index), obstacles, size, Truth(*truth))


@kernel
def write_truth(arrays, index, obstacles, size, truth):
    """Write poses, hand points, wheel speeds, margins and contacts of all robots into the arrays of a `Truth`.

    `arrays` are MujocoArrays, `index` is a TruthIndex, `obstacles` are the Footprints of walls and of moving boxes,
    `size` is a robot's clearance and body_radius [m]. The caller makes the arrays of `truth`: numpy does that faster
    than compiled code hands new ones out.
    """
    (walls, moving), (clearance, body_radius) = obstacles, size
    _write_poses(arrays.xpos, arrays.xmat, index.body, truth.body_pose)
    for j in range(len(index.body)):
        x, y = arrays.site_xpos[index.hand[j], 0], arrays.site_xpos[index.hand[j], 1]
        truth.hand_world[j, 0], truth.hand_world[j, 1] = x, y
        for side in range(2):
            truth.wheel_speed[j, side] = arrays.speed[index.wheel_speed[j, side]]
        truth.wall_margin[j] = margin(x, y, walls, clearance)
        truth.moving_margin[j] = margin(x, y, moving, clearance)
    write_contacts(arrays, index, (body_radius, len(moving.centre)), truth)


@kernel
def body_poses(xpos, xmat, body):
    """Return the poses (n, 3) x, y, heading of bodies, body (n,), from all bodies' xpos (B, 3) and xmat (B, 9)."""
    poses = np.empty((len(body), 3))
    _write_poses(xpos, xmat, body, poses)
    return poses


@kernel
def _write_poses(xpos, xmat, body, poses):
    for j in range(len(body)):
        k = body[j]
        poses[j, 0], poses[j, 1] = xpos[k, 0], xpos[k, 1]
        poses[j, 2] = math.atan2(xmat[k, 3], xmat[k, 0])  # of the body's x axis
