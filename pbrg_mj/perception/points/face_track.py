"""A face that is followed from scan to scan: its nearest place, its velocity with a covariance, whether it moves."""

from __future__ import annotations

import math

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.normal_flow import ANY_SPEED, FASTEST

TRACK = np.dtype(
    [(name, "f8") for name in ("x", "y", "vx", "vy", "cxx", "cxy", "cyy", "time", "told")]
    + [(name, "?") for name in ("live", "moves")]
)
"""Nearest place of a face [m], its velocity [m/s] and covariance [m^2/s^2], when it was last updated and when a flow
last told of it [s]; whether it moves."""

TRACKS = 12  # a robot
WALK = 0.1  # [m/s] by which the velocity of what moves walks in a second
WALK_AT_REST = 0.02  # [m/s] and of what seems to rest


@kernel
def closing_speed(track, normal):
    """Return how fast a face comes along -normal [m/s]: 0 until it is known to move, then by a deviation more."""
    nx, ny = normal
    speed = -(nx * track["vx"] + ny * track["vy"])
    variance = nx * nx * track["cxx"] + 2.0 * nx * ny * track["cxy"] + ny * ny * track["cyy"]
    return min(max(speed + math.sqrt(variance), 0.0), FASTEST) if track["moves"] else 0.0


@kernel
def any_moving(tracks):
    """Tell whether any track moves."""
    moving = False
    for i in range(len(tracks)):
        moving = moving or (tracks[i]["live"] and tracks[i]["moves"])
    return moving


@kernel
def any_moving_within(tracks, q, radius):
    """Tell whether any track that moves is within a radius [m] around a place q (2,) [m]."""
    near = False
    for i in range(len(tracks)):
        dx, dy = tracks[i]["x"] - q[0], tracks[i]["y"] - q[1]
        near = near or (tracks[i]["live"] and tracks[i]["moves"] and dx * dx + dy * dy <= radius * radius)
    return near


@kernel
def reset_velocity(track):
    """Let a track's velocity be that of a new one: unknown."""
    track["vx"], track["vy"], track["cxx"], track["cxy"], track["cyy"] = 0.0, 0.0, 0.0, 0.0, 0.0


@kernel
def predicted_covariance(track, time):
    """Return the covariance of a track's velocity at a time."""
    if track["cxx"] == 0.0:  # a new one
        return ANY_SPEED**2, 0.0, ANY_SPEED**2
    rate = WALK if track["moves"] else WALK_AT_REST
    walk = rate * rate * (time - track["time"])
    return track["cxx"] + walk, track["cxy"], track["cyy"] + walk


@kernel
def mahalanobis_from_rest(track):
    """Return the squared Mahalanobis distance of a track's velocity from rest."""
    return squared_mahalanobis(track["vx"], track["vy"], (track["cxx"], track["cxy"], track["cyy"]))


@kernel
def squared_mahalanobis(x, y, covariance):
    """Return the squared Mahalanobis distance of (x, y) from 0, by a covariance (xx, xy, yy)."""
    xx, xy, yy = covariance
    return (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
