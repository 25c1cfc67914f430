"""The true state, read from MuJoCo's arrays."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
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


def empty_truth(*shape: int) -> Truth:
    """Return a truth of robots (n,), or (T, n) of T ticks, whose arrays are still to be written."""
    margins, contacts = [np.empty(shape) for _ in range(2)], [np.empty(shape, dtype=bool) for _ in range(3)]
    pose, hand, speed = (np.empty((*shape, size)) for size in (3, 2, 2))
    return Truth(pose, hand, speed, margins[0], contacts[0], margins[1], *contacts[1:])


class TruthSampler:
    """Copies what the truth of a tick is made of, and makes it of many ticks in one call.

    Between two of MuJoCo's steps the copy takes two fifths of the time. Of sites and histories, most of which are the
    beams' and the camera's, only the robots' are copied.
    """

    def __init__(self, arrays: MujocoArrays, index: TruthIndex, walls: Footprints, size: tuple[float, float]):
        """Of one world whose arrays are `arrays`; `size` is a robot's clearance and body radius [m]."""
        hand, earlier = np.arange(index.hand.size), np.arange(index.earlier_contacts.size)
        moved = index._replace(hand=hand, earlier_contacts=earlier.reshape(index.earlier_contacts.shape))
        whole = [array.reshape(-1) for array in (arrays.xpos, arrays.xmat, arrays.speed, arrays.sensordata)]
        parts = (arrays.site_xpos, index.hand), (arrays.history, index.earlier_contacts.reshape(-1))
        self._sampled_from = tuple(whole), *parts
        sizes = [*(len(array) for array in whole), 3 * hand.size, earlier.size]
        self._constant = np.cumsum([0, *sizes]), tuple(moved), tuple(walls), size
        self._robots, self._width = hand.size, sum(sizes)

    def sample(self) -> np.ndarray:
        """Return xpos, xmat, speed and sensordata as they are now, the robots' sites and histories, in a row."""
        row = np.empty(self._width)
        _write_sample(*self._sampled_from, row)
        return row

    def truths(self, samples: Sequence[np.ndarray], moving: Sequence[Footprints]) -> list[Truth]:
        """Return the truth at each sample; `moving` are the moving boxes then, which differ in their places alone."""
        rows = np.concatenate(samples).reshape(len(samples), -1)
        centres = np.concatenate([boxes.centre for boxes in moving]).reshape(len(samples), -1, 2)
        truths = empty_truth(len(samples), self._robots)
        _write_truths(rows, self._constant, (tuple(moving[0]), centres), tuple(truths))
        return list(map(Truth, *truths))


@kernel
def _write_sample(whole, sites, histories, row):
    """Write the arrays `whole`, the places of some sites and some of a history to `row` (N,), one after the other.

    `whole` are xpos, xmat, speed and sensordata of `MujocoArrays`, flat; `sites` site_xpos (sites, 3) and which are
    chosen (n,); `histories` history (H,) and the places in it of all earlier (E,) contacts.
    """
    (site_xpos, chosen), (history, earlier), at = sites, histories, 0
    for array in whole:
        for k in range(len(array)):
            row[at + k] = array[k]
        at += len(array)
    for k in chosen:
        for axis in range(3):
            row[at + axis] = site_xpos[k, axis]
        at += 3
    for k in range(len(earlier)):
        row[at + k] = history[earlier[k]]


@kernel
def _write_truths(rows, constant, moving, truths):
    """Call `write_truth` for every row of `rows` (T, N), which are as `_write_sample` writes them.

    `constant` are starts (7,), where each array begins in a row and the last one ends, the members of index,
    `TruthIndex`, of walls, `Footprints`, and size of `write_truth`; `moving` are boxes, `Footprints` of those that
    move, and their centres (T, k, 2) [m]; `truths` are the members of `Truth`, each with T as its first axis.
    Tuples are plain ones: handing over named ones from Python costs 20 us more.
    """
    (starts, index, walls, size), (boxes, centres) = constant, moving
    index, walls, boxes, truths = TruthIndex(*index), Footprints(*walls), Footprints(*boxes), Truth(*truths)
    for t in range(len(rows)):
        arrays = MujocoArrays(
            rows[t, starts[0] : starts[1]].reshape(-1, 3),
            rows[t, starts[1] : starts[2]].reshape(-1, 9),
            rows[t, starts[4] : starts[5]].reshape(-1, 3),
            rows[t, starts[2] : starts[3]],
            rows[t, starts[3] : starts[4]],
            rows[t, starts[5] : starts[6]],
        )
        there = Footprints(centres[t], boxes.axis, boxes.half_size, boxes.radius, boxes.corners, boxes.first)
        truth = Truth(
            truths.body_pose[t],
            truths.hand_world[t],
            truths.wheel_speed[t],
            truths.wall_margin[t],
            truths.wall_contact[t],
            truths.moving_margin[t],
            truths.moving_contact[t],
            truths.robot_contact[t],
        )
        write_truth(arrays, index, (walls, there), size, truth)


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
