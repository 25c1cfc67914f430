"""The tracks of one robot in plain numpy: the rules of update, association and confirmation, with matrices and lists.

Beams say nothing here (no echo, no free ends), so nothing is contradicted and no end is known; and no two walls meet at
a corner. A list of `Track`s stands for the array of records; a track that is not alive is a free place.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from pbrg_mj.perception.track.association import GATE
from pbrg_mj.perception.track.confirmation import MIN_SIGHTINGS, WIDE_RATIO
from pbrg_mj.perception.track.extent import SIGMAS
from pbrg_mj.perception.track.records import TrackParameters
from pbrg_mj.perception.track.update import MAX_CONTRADICTIONS, SEEN_SHARE
from pbrg_mj.perception.track.world_frame import ScanPose

NEAR_ANGLE, NEAR_OFFSET, SAME_ANGLE, SAME_OFFSET = math.radians(10.0), 0.15, math.radians(1.0), 0.01  # [rad], [m]
HIDDEN_GAP, MIN_OVERLAP, LONG_EXTENT = 0.6, 0.1, 1.0  # [m] the gap where no end is known
TOLERANCE, WIDEST, MAX_REST_SPEED = 0.01, 0.15, 0.1  # [m], [m/s]


@dataclass(eq=False)
class Track:
    """A wall n . (q - anchor) = c, x = (angle of n, c) with covariance P, and the extent of it that was seen."""

    x: np.ndarray
    P: np.ndarray
    extent: tuple[float, float]
    first: float
    seen: float
    place: np.ndarray  # the middle of the first extent, in the world
    direction: float  # of the normal then
    sightings: list[tuple[float, float, float]] = field(default_factory=list)  # time, way along the normal, variance
    noises: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)  # what its error has of each, covariances
    away: float = 0.0
    live: bool = True
    confirmed: bool = False
    hits: int = 1
    unseen: int = 0
    conflicts: int = 0

    @property
    def C(self) -> np.ndarray:
        """Covariance of the error, the sum of A v over all sightings."""
        return np.sum([A @ R @ A.T for A, R in self.noises], axis=0)


@dataclass(frozen=True)
class Sighting:
    """A line of a scan."""

    x: np.ndarray
    R: np.ndarray
    of_error: np.ndarray
    extent: tuple[float, float]


def turned(angle: float) -> float:
    return math.remainder(angle, 2 * math.pi)


def difference(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.array([turned(a[0] - b[0]), a[1] - b[1]])


def mahalanobis(error: np.ndarray, S: np.ndarray) -> float:
    return float(error @ np.linalg.solve(S, error))


def normal_of(angle: float) -> np.ndarray:
    return np.array([math.cos(angle), math.sin(angle)])


def tangent_of(angle: float) -> np.ndarray:
    return np.array([-math.sin(angle), math.cos(angle)])


def update_tracks(
    tracks: list[Track], lines: np.ndarray, now: ScanPose, params: TrackParameters, places: int
) -> list[str]:
    """Bring the tracks up to date with a scan and return the lines' roles; `places` is how many tracks there may be."""
    seen = [
        Sighting(
            np.array([line["angle"], line["offset"]]),
            np.array([[line["c_aa"], line["c_ac"]], [line["c_ac"], line["c_cc"]]]),
            np.array([[line["e_aa"], line["e_ac"]], [line["e_ac"], line["e_cc"]]]),
            (float(line["low"]), float(line["high"])),
        )
        for line in lines
    ]
    for track in tracks:
        if track.live:
            predict(track, now, params)
    roles = associate(tracks, seen)
    new = []
    for line, (role, track) in zip(seen, roles, strict=True):
        if role == "update":
            fuse(united(tracks, track, line), line, now, params)
        elif role == "extend":
            track.extent = hull(track.extent, line.extent)
        elif role == "conflict":
            track.conflicts += 1
            track.live &= track.confirmed and track.conflicts < MAX_CONTRADICTIONS
        if role == "new" or (role == "conflict" and not track.live):
            new.append(line)
    for line in new:
        begin(tracks, line, now, params, places)
    for i, a in enumerate(tracks):
        for b in tracks[:i]:
            if a.live and b.live and same_line(a, b):
                absorb(a, b)
    return [role for role, _ in roles]


def predict(track: Track, now: ScanPose, params: TrackParameters) -> None:
    """The anchor moves with the robot: c' = c - n . shift, so d c' / d angle = - t . shift."""
    shift = np.array([now.shift_x, now.shift_y])
    along = float(tangent_of(track.x[0]) @ shift)
    F = np.array([[1.0, 0.0], [-along, 1.0]])
    share = 1.0 if track.unseen else SEEN_SHARE
    Q = np.diag([params.turn, params.drift]) ** 2 * share**2 * now.elapsed
    track.x = track.x - [0.0, normal_of(track.x[0]) @ shift]
    track.P = F @ track.P @ F.T + Q
    track.noises, track.away = [(F @ A, R) for A, R in track.noises], track.away + now.elapsed
    track.extent = (track.extent[0] - along, track.extent[1] - along)
    track.unseen += 1
    kept = now.time - track.seen <= params.memory + 1e-9
    track.live = kept and (track.confirmed or track.unseen <= MAX_CONTRADICTIONS)


def apart(a: tuple[float, float], b: tuple[float, float]) -> float:
    """The gap between two extents; negative when they overlap."""
    return max(a[0], b[0]) - min(a[1], b[1])


def hull(a: tuple[float, float], b: tuple[float, float]) -> tuple[float, float]:
    return min(a[0], b[0]), max(a[1], b[1])


def distance(track: Track, line: Sighting) -> float:
    error = difference(line.x, track.x)
    return math.inf if abs(error[0]) > 0.5 else mahalanobis(error, track.P + line.R)


def associate(tracks: list[Track], seen: list[Sighting]) -> list[tuple[str, Track]]:
    """A role and a track for every line: the nearest pair first, and so on within the gate."""
    nobody = Track(np.zeros(2), np.eye(2), (0, 0), 0, 0, np.zeros(2), 0)
    result = [("new", nobody)] * len(seen)
    pairs = []
    for k, line in enumerate(seen):
        for i, track in enumerate(tracks):
            if not track.live or apart(track.extent, line.extent) >= HIDDEN_GAP:
                continue
            cost = distance(track, line)
            turn, off = difference(line.x, track.x)
            near = abs(turn) < NEAR_ANGLE and abs(off + turn * sum(line.extent) / 2) < NEAR_OFFSET
            if cost <= GATE:
                pairs.append((cost, k, i))
            elif near and result[k][0] == "new":
                result[k] = ("conflict", track)
    given: set[int] = set()
    taken: set[int] = set()
    for _, k, i in sorted(pairs):
        if k not in given:
            result[k] = ("extend" if i in taken else "update", tracks[i])
            given.add(k)
            taken.add(i)
    return result


def united(tracks: list[Track], track: Track, line: Sighting) -> Track:
    """Make all tracks one that the line runs through."""
    for other in tracks:
        if other is not track and other.live and -apart(other.extent, line.extent) > MIN_OVERLAP:
            track = absorb(track, other) if distance(other, line) <= GATE else track
    return track


def fuse(track: Track, line: Sighting, now: ScanPose, params: TrackParameters) -> None:
    """Two independent Gaussian estimates of the same line, weighted by their information."""
    note(track, line, now)
    W, V = np.linalg.inv(track.P), np.linalg.inv(line.R)
    P = np.linalg.inv(W + V)
    track.x = track.x + P @ V @ difference(line.x, track.x)
    track.x[0] = turned(track.x[0])
    track.P, track.seen, track.away = P, now.time, 0.0
    track.noises = [((np.eye(2) - P @ V) @ A, R) for A, R in track.noises] + [(P @ V, line.of_error)]
    track.hits, track.unseen, track.conflicts = track.hits + 1, 0, 0
    track.extent = hull(track.extent, line.extent)
    confirm(track, line, now, params)


def note(track: Track, line: Sighting, now: ScanPose) -> None:
    """How far the wall is, along its normal, from where it was first seen."""
    from_robot = track.place - [now.x, now.y]
    lever = float(tangent_of(line.x[0]) @ from_robot)
    gap = line.x[1] - normal_of(line.x[0]) @ from_robot
    to_c = np.array([-lever, 1.0])  # of the gap by (angle, c)
    way = float(gap) / max(math.cos(turned(line.x[0] - track.direction)), 0.5)
    track.sightings.append((now.time - track.first, way, float(to_c @ line.R @ to_c)))


def confirm(track: Track, line: Sighting, now: ScanPose, params: TrackParameters) -> None:
    length = line.extent[1] - line.extent[0]
    wide = length >= WIDE_RATIO * line.x[1]
    large = (
        length >= LONG_EXTENT or wide if track.hits > 1 else now.elapsed == 0 and (length >= 2 * LONG_EXTENT or wide)
    )
    slid = (track.seen - track.first) * MAX_REST_SPEED > (1 + 1 / params.silent) * WIDEST + 4 * TOLERANCE
    track.confirmed = bool(track.confirmed or large or (rests(track) and slid))


def rests(track: Track) -> bool:
    """Weighted least squares for the speed along the normal."""
    if track.hits < MIN_SIGHTINGS:
        return False
    tau, way, variance = np.array(track.sightings).T
    design, weight = np.column_stack([np.ones_like(tau), tau]), 1 / variance
    covariance = np.linalg.inv((design.T * weight) @ design)
    _, speed = covariance @ (design.T * weight) @ way
    return bool(abs(speed) + SIGMAS * math.sqrt(covariance[1, 1]) < MAX_REST_SPEED)


def begin(tracks: list[Track], line: Sighting, now: ScanPose, params: TrackParameters, places: int) -> None:
    middle = sum(line.extent) / 2
    place = np.array([now.x, now.y]) + line.x[1] * normal_of(line.x[0]) + middle * tangent_of(line.x[0])
    x, time = np.array([turned(line.x[0]), line.x[1]]), now.time
    track = Track(x, line.R.copy(), line.extent, time, time, place, float(line.x[0]))
    track.noises = [(np.eye(2), line.of_error)]
    free = next((i for i, old in enumerate(tracks) if not old.live), None)
    if free is None and len(tracks) == places:
        weak = [i for i, old in enumerate(tracks) if not old.confirmed and old.x[1] > line.x[1]]
        if not weak:
            return
        free = max(weak, key=lambda i: tracks[i].x[1])
    note(track, line, now)
    confirm(track, line, now, params)
    tracks[slice(len(tracks), None) if free is None else slice(free, free + 1)] = [track]


def same_line(a: Track, b: Track) -> bool:
    """The same line within their errors; the ends are unknown, so any gap may be hidden."""
    error = difference(b.x, a.x)
    S = a.P + b.P + np.diag([SAME_ANGLE, SAME_OFFSET]) ** 2
    return abs(error[0]) <= 0.2 and mahalanobis(error, S) <= GATE


def absorb(a: Track, b: Track) -> Track:
    """Make two tracks one: the confirmed one stays, or the older."""
    if (b.confirmed, -b.first) > (a.confirmed, -a.first):
        a, b = b, a
    a.extent = hull(a.extent, b.extent)
    if b.seen >= a.seen:
        a.seen, a.unseen, a.away = b.seen, b.unseen, b.away
    b.live = False
    return a
