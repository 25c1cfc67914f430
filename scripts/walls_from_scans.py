"""Turn laser scans of a real building into a scenario: echoes become walls, and a team drives where the robot did.

python scripts/walls_from_scans.py LOG [--scan N] [--scans N] [--ahead M] [--range-max M] [-o FILE.yaml]

LOG is in CARMEN's format, gzipped or not, best with corrected poses: lines `FLASER n r_1 .. r_n x y theta ...` with the
laser's pose. Scans from `--scan` on, taken a metre apart, are put together in the frame of the first pose. Echoes
that follow each other without a gap become walls along their simplified outline (Douglas and Peucker, 1973), echoes on
their own become posts. What was seen within a robot's breadth of the way that the robot drove is left out: it moved.
The reference lies on that way, `--ahead` metres on. What no scan saw is open floor.
"""

from __future__ import annotations

import argparse
import gzip
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

APART = 1.0  # between the places of scans that are put together [m]
GAP = 0.3  # between echoes that follow each other on one thing [m], and
GAP_RATIO = 0.06  # per range: beams 1 degree apart on a wall met at 17 degrees
TOLERANCE = 0.03  # of an outline's simplification [m]: noise of the lasers, two deviations
THICKNESS = 0.04  # of walls; posts are as thick [m]
KNOWN = 0.06  # a wall as near as this to one that is there is that one [m]
CLEAR = 0.3  # half the breadth of the way that the robot drove [m]
TEAM = np.array([[0.0, 0.0], [-0.18, 0.3], [-0.18, -0.3]])
MOST_WALLS = 500


def scans(file: Path) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield the ranges (n,) [m] and the laser's pose (3,) x, y [m], heading [rad] of each front scan."""
    opened = gzip.open if file.suffix == ".gz" else open
    with opened(file, "rt", encoding="utf-8", errors="replace") as lines:
        for line in lines:
            words = line.split()
            if words and words[0] == "FLASER" and len(words) >= 5 + int(words[1]):
                n = int(words[1])
                numbers = np.array(words[2 : 5 + n], dtype=float)
                yield numbers[:n], numbers[n:]


def bearings(n: int) -> np.ndarray:
    """Return the directions (n,) [rad] of a front laser's readings from -90 degrees on: 180 or 181 a degree apart."""
    return -np.pi / 2 + np.arange(n) * (np.pi / (n - n % 2))


def runs(ranges: np.ndarray, far: float) -> Iterator[np.ndarray]:
    """Yield the echoes (k, 2) [m], in the laser's frame, of each thing in turn."""
    angle, hit = bearings(len(ranges)), (ranges > 0.0) & (ranges < far)
    echoes = ranges[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    run: list[np.ndarray] = []
    for k in range(len(ranges)):
        near = run and hit[k] and np.linalg.norm(echoes[k] - run[-1]) < GAP + GAP_RATIO * ranges[k]
        if run and not near:
            yield np.array(run)
            run = []
        if hit[k]:
            run.append(echoes[k])
    if run:
        yield np.array(run)


def simplified(points: np.ndarray, tolerance: float = TOLERANCE) -> np.ndarray:
    """Return the corners (c, 2) of an outline that passes all of `points` (k, 2) within the tolerance [m]."""
    if len(points) < 3:
        return points
    off = distances(points, points[[0, -1]][None])[:, 0]
    worst = int(off.argmax())
    if off[worst] <= tolerance:
        return points[[0, -1]]
    parts = simplified(points[: worst + 1], tolerance)[:-1], simplified(points[worst:], tolerance)
    return np.concatenate(parts)


def distances(points: np.ndarray, segments: np.ndarray) -> np.ndarray:
    """Return the distances (k, s) of points (k, 2) from segments (s, 2, 2) [m]."""
    side = segments[:, 1] - segments[:, 0]
    offset = points[:, None] - segments[:, 0]
    share = np.sum(offset * side, axis=-1) / np.maximum(np.sum(side**2, axis=-1), 1e-12)
    return np.linalg.norm(offset - np.clip(share, 0.0, 1.0)[..., None] * side, axis=-1)


def walls(chosen: list[tuple[np.ndarray, np.ndarray]], way: np.ndarray, far: float) -> np.ndarray:
    """Return the segments (s, 2, 2) [m] of what the scans saw, none twice and none on the way (w, 2) [m]."""
    found: list[np.ndarray] = []
    steps = np.stack([way[:-1], way[1:]], axis=1)
    for ranges, (x, y, heading) in chosen:
        turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
        for run in runs(ranges, far):
            corners = simplified(run @ turn.T + [x, y])
            for start, end in pairwise(corners if len(corners) > 1 else np.repeat(corners, 2, axis=0)):
                points = start + np.linspace(0.0, 1.0, 9)[:, None] * (end - start)
                known = found and (distances(points, np.array(found)).min(axis=1) < KNOWN).all()
                if not known and distances(points, steps).min() > CLEAR:
                    found.append(np.array([start, end]))
    return np.array(found).reshape(-1, 2, 2)


def scenario(file: Path, first: int, count: int, ahead: float, far: float) -> dict[str, Any]:
    """Return a scenario's data. Raises ValueError where the log has no such scan or the robot drove no farther."""
    every = list(scans(file))
    if not 0 <= first < len(every):
        raise ValueError(f"{file} has {len(every)} front scans; there is no scan {first}")
    x, y, heading = every[first][1]
    turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    later = [(ranges, np.array([*(turn @ (pose[:2] - [x, y])), pose[2] - heading])) for ranges, pose in every[first:]]
    place = np.array([pose[:2] for _, pose in later])
    arrived = np.flatnonzero(np.hypot(*place.T) >= ahead)
    if not len(arrived):
        raise ValueError(f"from scan {first} on the robot came no farther than {np.hypot(*place.T).max():.2f} m")
    way, chosen = place[: arrived[0] + 1], [later[0]]
    for one in later[1 : arrived[0] + 1]:
        if len(chosen) < count and np.hypot(*(one[1][:2] - chosen[-1][1][:2])) >= APART:
            chosen.append(one)
    segments = np.round(walls(chosen, np.concatenate([TEAM, way]), far), 3)
    posts = np.hypot(*(segments[:, 1] - segments[:, 0]).T) < 1e-2
    if (~posts).sum() > MOST_WALLS or posts.sum() > MOST_WALLS:
        raise ValueError(f"{(~posts).sum()} walls and {posts.sum()} posts; allowed: {MOST_WALLS} each, by fewer scans")
    return {
        "description": f"Walls from {len(chosen)} laser scans of {file.name.split('.')[0]}, from scan {first} on",
        "timing": {"duration": 30.0},
        "team": {"start": TEAM.tolist(), "formation": TEAM.tolist(), "leaders": [1]},
        "world": {
            "walls": [
                {"from": start, "to": end, "thickness": THICKNESS, "height": 0.3}
                for start, end in segments[~posts].tolist()
            ],
            "columns": [{"center": at, "radius": THICKNESS / 2, "height": 0.3} for at, _ in segments[posts].tolist()],
        },
        "sensors": {"beams": {"preset": "lidar"}},
        "estimator": {"source": "points", "scope": "own", "half_spaces_per_robot": 6},
        "governor": {"kind": "certified", "initial": "start"},
        "operator": {"reference": np.round(way[-1], 3).tolist()},
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path)
    parser.add_argument("--scan", type=int, default=0, help="the first scan, counted from 0")
    parser.add_argument("--scans", type=int, default=3, help="how many are put together at most")
    parser.add_argument("--ahead", type=float, default=2.5, help="of the reference [m]")
    parser.add_argument("--range-max", type=float, default=7.9, help="farther readings are no echoes [m]")
    parser.add_argument("-o", "--output", type=Path, default=Path("building.yaml"))
    given = parser.parse_args()
    try:
        data = scenario(given.log, given.scan, given.scans, given.ahead, given.range_max)
    except (OSError, ValueError) as error:
        parser.exit(2, f"error: {error}\n")
    with given.output.open("w", encoding="utf-8") as file:
        YAML().dump(data, file)
    print(f"{given.output}: {len(data['world']['walls'])} walls, {len(data['world']['columns'])} posts")


if __name__ == "__main__":
    main()
