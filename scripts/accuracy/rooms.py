"""Rooms, and how right a robot that drives in them is about their walls.

python scripts/accuracy/rooms.py [--seeds 100] [--sensors generic lidar]    # the table of docs/perception-accuracy.md

A room is drawn anew for each seed, convex with 4 to 6 walls, an L, or larger with 7 or 8, and a robot drives through it
on an arc. A scan that takes time is taken on its way, a cone tells the nearest of its rays, and no echo is too weak to
be seen. The normalised error squared is that of one wall a room, drawn among those that bind: walls of one room share
the pose's error.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from raycast import Scene, cast_along, wheels
from scanning_robot import CLEARANCE, HAND, OTHERS, SENSORS, normalised, scenario
from table import print_table
from walls import band

from pbrg_mj.perception.perceive import initial, perceive
from pbrg_mj.perception.setup import perception_setup
from pbrg_mj.scenario.schema import Scenario, ray_angles
from pbrg_mj.sensing.noise import sensor_noise
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.sensing.sense import sense
from pbrg_mj.world.plant.interface import Observation

SPEED, TURN = 0.2, 0.5  # largest of the robots [m/s], [rad/s]
AWAY = 0.2  # of its way from all walls [m]
SCANS = (3, 10, 30)
ALIKE = np.deg2rad(30)  # a track whose normal is farther off is of no wall


def convex_room(random: np.random.Generator) -> np.ndarray:
    """Corners (4 to 6, 2) of a convex room, counter-clockwise: on a circle, none nearer than 40 deg to the next."""
    return _on_circle(random, (4, 6), np.deg2rad(40), (1.2, 2.5))


def l_room(random: np.random.Generator) -> np.ndarray:
    """Corners (6, 2) of a room like an L, counter-clockwise."""
    (a, b), (c, d) = random.uniform(2.0, 4.0, 2), random.uniform(0.4, 0.6, 2)
    corners = np.array([[0, 0], [a, 0], [a, d * b], [c * a, d * b], [c * a, b], [0, b]]) - [0.4 * c * a, 0.4 * d * b]
    angle = random.uniform(0, 2 * np.pi)
    return corners @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def obtuse_room(random: np.random.Generator) -> np.ndarray:
    """Corners (7 or 8, 2) of a larger convex room, counter-clockwise, none nearer than 30 deg to the next."""
    return _on_circle(random, (7, 8), np.deg2rad(30), (2.0, 3.4))


def _on_circle(
    random: np.random.Generator, counts: tuple[int, int], gap: float, radii: tuple[float, float]
) -> np.ndarray:
    """Corners on a circle, of a number and a radius [m] from one to another, none nearer than a gap [rad]."""
    count = int(random.integers(counts[0], counts[1] + 1))
    gaps = gap + random.dirichlet(np.full(count, 3.0)) * (2 * np.pi - count * gap)
    angle = random.uniform(0, 2 * np.pi) + np.cumsum(gaps)
    return random.uniform(*radii) * np.column_stack([np.cos(angle), np.sin(angle)])


ROOMS = {"convex_room": convex_room, "l_room": l_room, "obtuse_room": obtuse_room}


def walls_of(corners: np.ndarray) -> Scene:
    """The walls of a room of corners (c, 2)."""
    return Scene(tuple((*a, *b) for a, b in zip(corners.tolist(), np.roll(corners, -1, axis=0).tolist(), strict=True)))


def way(random: np.random.Generator, corners: np.ndarray, duration: float) -> tuple[np.ndarray, float, float]:
    """A pose (3,) to start from, a speed [m/s] and a turn [rad/s] that keep a robot off the walls for that long [s]."""
    while True:
        start = np.append(random.uniform(corners.min(axis=0), corners.max(axis=0)), random.uniform(-np.pi, np.pi))
        speed, turn = random.uniform(0.05, SPEED), random.uniform(-TURN, TURN)
        places = np.array([pose_at(start, speed, turn, t)[:2] for t in np.linspace(0, duration, 40)])
        if all(inside(place, corners) and _room(place, corners) > AWAY for place in places):
            return start, speed, turn


def pose_at(start: np.ndarray, speed: float, turn: float, time: float) -> np.ndarray:
    """The pose (3,) of a robot on its arc."""
    heading = start[2] + turn * time
    chord = speed * time * np.sinc(turn * time / (2 * np.pi))
    middle = start[2] + 0.5 * turn * time
    return np.array([start[0] + chord * np.cos(middle), start[1] + chord * np.sin(middle), heading])


def _sides(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return corners, np.roll(corners, -1, axis=0)


def inside(place: np.ndarray, corners: np.ndarray) -> bool:
    """Whether a place (2,) is in a room."""
    a, b = _sides(corners)
    crosses = (a[:, 1] > place[1]) != (b[:, 1] > place[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        x = a[:, 0] + (place[1] - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return bool(np.sum(crosses & (x > place[0])) % 2)


def _room(place: np.ndarray, corners: np.ndarray) -> float:
    return float(distances(place, *_sides(corners)).min())


def distances(place: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distances (w,) [m] of a place from walls from a to b (w, 2)."""
    along = np.clip(np.sum((place - a) * (b - a), axis=1) / np.sum((b - a) ** 2, axis=1), 0, 1)
    return np.linalg.norm(a + along[:, None] * (b - a) - place, axis=1)


class Drive:
    """A robot that drives in a room and scans, by `sensing` and its clock."""

    def __init__(self, given: Scenario, corners: np.ndarray, start: np.ndarray, speed: float, turn: float) -> None:
        self.setup, self.noise = perception_setup(given, CLEARANCE, HAND), sensor_noise(given)
        self.beams, self.camera = given.sensors.beams, given.sensors.camera
        self.corners, self.start, self.speed, self.turn = corners, start, speed, turn
        self.step = given.timing.physics_step  # beams of a scan that takes time are taken at the first one when due
        self.memory = initial(self.setup)
        self.readings: Readings | None = None
        self.scans, self.frame = int(self.beams.scan_time > 0), -1
        self.angles = ray_angles(self.beams).reshape(self.beams.count, self.beams.rays)
        self.raw: tuple[int, np.ndarray] = -1, np.empty(0)

    def scan(self) -> None:
        """Go on to the robot's next scan; the camera's frames until then are told one after the other."""
        time = self.scans / self.beams.rate_hz
        newest = max(int((time - self.camera.delay) * self.camera.rate_hz + 1e-9), 0)
        for frame in range(self.frame + 1, newest):
            told = max(frame / self.camera.rate_hz + self.camera.delay, 0.0)
            self.tell(self.observed(frame, self.scans - 1, told))
        self.frame = newest
        self.tell(self.observed(newest, self.scans, time))
        self.scans += 1

    def tell(self, observed: Observation) -> None:
        """Let the robot sense and perceive."""
        self.readings = sense(observed, self.readings, self.noise)
        _, self.memory = perceive(self.readings, observed.time, self.memory, self.setup)

    def observed(self, frame: int, scan: int, time: float) -> Observation:
        """What the sensors hold at a time [s]: a frame of the camera and a scan, none before the first turn is over."""
        if self.raw[0] != scan:
            self.raw = scan, self.cast(scan / self.beams.rate_hz)
        number = -1 if scan == 0 and self.beams.scan_time > 0 else scan
        return Observation(self.pose(frame / self.camera.rate_hz)[None], frame, self.raw[1][None], number, time)

    def cast(self, end: float) -> np.ndarray:
        """Exact ranges (count * rays,) [m] of a scan that ends at a time [s], -1 for no hit; no echo is too weak."""
        walls, ranges = walls_of(self.corners), []
        for k, angles in enumerate(self.angles):
            due = end - self.beams.scan_time * (1.0 - (k + 1) / self.beams.count)
            pose = self.pose(due if self.beams.scan_time == 0.0 else np.ceil(due / self.step - 1e-6) * self.step)
            scene = walls + wheels(pose, self.beams.height)
            ranges.append(cast_along(scene, pose, angles, self.beams.range_max))
        return np.nan_to_num(np.concatenate(ranges), nan=-1.0)

    def pose(self, time: float) -> np.ndarray:
        """The true pose (3,) at a time [s]."""
        return pose_at(self.start, self.speed, self.turn, time)

    def errors(self) -> list[tuple[float, float, float]]:
        """Angle error [rad], offset error [m] and normalised error squared of each track of a wall that binds."""
        tracks, anchor = self.memory.tracks[0], self.memory.anchors[0]
        place = np.array([anchor["x"], anchor["y"]])
        bind, (a, b) = tracks[(tracks["live"] == 1) & (tracks["confirmed"] == 1)], _sides(self.corners)
        found = ((track, wall_errors(track, place, a, b, normals(a, b))) for track in bind)
        return [(*error.tolist(), normalised(error, track, self.setup)) for track, error in found if error is not None]


def normals(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Unit normals (w, 2) of walls from a to b (w, 2), to their right."""
    along = (b - a) / np.linalg.norm(b - a, axis=1)[:, None]
    return np.column_stack([along[:, 1], -along[:, 0]])


def wall_errors(
    track: np.void, place: np.ndarray, a: np.ndarray, b: np.ndarray, outward: np.ndarray
) -> np.ndarray | None:
    """Errors (2,) of a track's angle [rad] and offset from the place of its anchor [m]; None if it is of no wall.

    It is of the wall nearest to the middle of its extent among those alike in angle. Faces are from a to b (w, 2), and
    their normals (w, 2) point outward.
    """
    normal = np.array([np.cos(track["angle"]), np.sin(track["angle"])])
    middle = 0.5 * (track["low"] + track["high"])
    point = place + track["offset"] * normal + middle * np.array([-normal[1], normal[0]])
    off = np.where(outward @ normal > np.cos(ALIKE), distances(point, a, b), np.inf)
    k = int(np.argmin(off))
    if np.isinf(off[k]):
        return None
    turn = track["angle"] - np.arctan2(outward[k, 1], outward[k, 0])
    return np.array([np.angle(np.exp(1j * turn)), track["offset"] - outward[k] @ (a[k] - place)])


def drive(given: Scenario, room: str, scans: tuple[int, ...]) -> np.ndarray:
    """Rows (len(scans), 3) of one wall, angle error [rad], offset error [m], normalised error squared; NaN for none."""
    random = np.random.default_rng([given.seed, list(ROOMS).index(room)])
    corners = ROOMS[room](random)
    robot = Drive(given, corners, *way(random, corners, scans[-1] / given.sensors.beams.rate_hz))
    rows = np.full((len(scans), 3), np.nan)
    for k in range(1, scans[-1] + 1):
        robot.scan()
        if k in scans and (found := robot.errors()):
            rows[scans.index(k)] = found[int(random.integers(len(found)))]
    return rows


def rows_of(sensor: str, seeds: int) -> Iterator[list[str]]:
    """A row for each kind of room: the mean of the normalised errors squared after each of SCANS, and its band.

    The band is that of the fewest rooms in which some wall binds by then.
    """
    for room in ROOMS:
        rows = np.array([drive(scenario(sensor, seed), room, SCANS) for seed in range(seeds)])
        counts = np.isfinite(rows[:, :, 2]).sum(axis=0)
        (low, high), cells = band(int(counts.min())), [sensor, room, ", ".join(map(str, np.unique(counts)))]
        for k in range(len(SCANS)):
            some = rows[np.isfinite(rows[:, k, 2]), k]
            angle, offset = np.sqrt(np.mean(some[:, :2] ** 2, axis=0))
            cells += [f"{some[:, 2].mean():.2f}", f"{np.median(some[:, 2]):.2f}"]
            cells += [f"{np.rad2deg(angle):.2f} deg, {1000 * offset:.1f} mm"] if SCANS[k] == SCANS[-1] else []
        yield [*cells, f"{low:.2f} to {high:.2f}"]


if __name__ == "__main__":
    after = [name for scans in SCANS for name in (f"NEES after {scans} scans", "median")]
    columns, sensors = ["sensor", "room", "rooms", *after, "RMS then", "band of the mean"], (*SENSORS, *OTHERS)
    print_table(__doc__, columns, rows_of, 100, sensors, sensors)
