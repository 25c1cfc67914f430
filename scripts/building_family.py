"""Write a family of worlds in real buildings: outlines from laser logs, and the ways that the robots drove there.

python scripts/building_family.py --building LOG BEGIN END [--building LOG BEGIN END ...] [--note TEXT ...] -o FILE.yaml

LOG is as for `walls_from_scans.py`; BEGIN and END [m] say which part of the robot's way is taken. All scans of a log
vote on a grid: a cell is occupied where many of the beams that came there ended there, so that what moved is left out.
Echoes in such cells, scan after scan along that part, become outlines where none is known yet. What was within a
robot's breadth of the way is left out. Notes go into the file's head: whose logs they are.
"""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
from walls_from_scans import CLEAR, GAP, GAP_RATIO, bearings, distances, scans, simplified

Scan = tuple[np.ndarray, np.ndarray]  # ranges (n,) [m]; the laser's x, y [m] and heading [rad]
CELL = 0.05  # of the grid [m]
FAR = 8.0  # of the range of beams that vote [m]: the reach of the shortest of these lasers
NEAR = 5.0  # of echoes that become outlines [m]: beams a degree apart are 9 cm apart there
FEWEST, SHARE = 3, 0.35  # of scans with an echo in an occupied cell, and of all whose beams came there
VOTE_APART = 0.15, 0.3  # between scans that vote [m], [rad]: one that stands still has one vote
APART = 0.3, 0.5  # between scans that give outlines [m], [rad]
KNOWN = 0.12  # an echo as near as this to an outline is known [m]: poses of two visits differ by so much
WAY_TOLERANCE = 0.05  # of the way's simplification [m]
LEAST_LENGTH = 0.06  # of an outline [m]; what is shorter is a post
HEAD = """\
# yaml-language-server: $schema=../family_schema.json
# Places in real buildings, put together from laser logs by scripts/building_family.py.
"""
FAMILY = """\
description: "Places in real buildings, on the ways that robots with laser scanners drove there"
timing: {duration: 12.0}
team: {leaders: [1]}
governor: {initial: start}
draw:
  team: {robots: {integer: [3, 5]}, start_radius: 0.55, formation_radius: {uniform: [0.35, 0.55]}}
  reference: {distance: {uniform: [1.5, 3.0]}, direction_deg: {uniform: [-180, 180]}}
  keys:
    team.heading_deg: {uniform: [-180, 180], per_robot: true}
    sensors.beams.preset: {choice: [generic, robotarium, tof_ring, lidar]}
    estimator.scope: {choice: [own, team]}
  buildings:
"""


def apart(every: list[Scan], metres: float, turn: float) -> list[Scan]:
    """Return the scans that are so far, or turned so much [rad], from the one before."""
    kept = every[:1]
    for one in every[1:]:
        dx, dy, turned = one[1] - kept[-1][1]
        if np.hypot(dx, dy) >= metres or abs(np.angle(np.exp(1j * turned))) >= turn:
            kept.append(one)
    return kept


class Grid:
    """The cells of a building's floor, and which of them are occupied."""

    def __init__(self, every: list[Scan]):
        """Let every scan vote once on each cell."""
        places = np.array([pose[:2] for _, pose in every])
        self._low = places.min(axis=0) - FAR - CELL
        self._shape = tuple(((places.max(axis=0) + FAR + CELL - self._low) / CELL).astype(int) + 1)
        ended, passed = np.zeros((2, *self._shape), dtype=int)
        along = np.arange(0.0, FAR, CELL)
        for ranges, (x, y, heading) in every:
            angle = heading + bearings(len(ranges))
            ray = np.column_stack([np.cos(angle), np.sin(angle)])
            hit = (ranges > 0.0) & (ranges < FAR)
            # An echo from afar tells that all before it is free; silence tells nothing.
            beam, step = np.nonzero(along < (np.where(ranges > 0.0, ranges, 0.0) - 2 * CELL)[:, None])
            passed[self._cells(np.array([x, y]) + along[step, None] * ray[beam])] += 1
            ended[self._cells(np.array([x, y]) + ranges[hit, None] * ray[hit])] += 1
        occupied = np.pad((ended >= FEWEST) & (ended >= SHARE * (ended + passed)), 1)
        beside = occupied[:-2, 1:-1] | occupied[2:, 1:-1] | occupied[1:-1, :-2] | occupied[1:-1, 2:]
        self._agreed = occupied[1:-1, 1:-1] | beside

    def agreed(self, points: np.ndarray) -> np.ndarray:
        """Return of points (k, 2) [m] which are in an occupied cell or beside one."""
        x, y = self._indices(points).T
        return self._agreed[x, y]

    def _indices(self, points: np.ndarray) -> np.ndarray:
        return np.clip(((points - self._low) / CELL).astype(int), 0, np.array(self._shape) - 1)

    def _cells(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the indices of the points' cells, each cell once."""
        x, y = self._indices(points).T
        return np.divmod(np.unique(x * self._shape[1] + y), self._shape[1])


def outlines(chosen: list[Scan], grid: Grid, way: np.ndarray) -> list[np.ndarray]:
    """Return the corners (c, 2) [m] of what the scans saw and the grid agrees to, none twice and none on the way."""
    steps = np.stack([way[:-1], way[1:]], axis=1)
    found: list[np.ndarray] = []
    known = np.zeros((0, 2, 2))
    for ranges, (x, y, heading) in chosen:
        angle = heading + bearings(len(ranges))
        reach = np.clip(ranges, 0.0, NEAR)
        echoes = np.array([x, y]) + reach[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        seen = (ranges > 0.0) & (ranges < NEAR) & grid.agreed(echoes)
        seen &= distances(echoes, steps).min(axis=1) > CLEAR
        new = seen & (distances(echoes, known).min(axis=1, initial=np.inf) > KNOWN)
        step = np.hypot(*np.diff(echoes, axis=0).T)
        joined = seen[:-1] & seen[1:] & (step < GAP + GAP_RATIO * ranges[:-1])
        for first, last in runs(new, joined):
            corners = simplified(echoes[first : last + 1])
            found.append(corners)
            closed = corners if len(corners) > 1 else np.repeat(corners, 2, axis=0)
            known = np.concatenate([known, np.stack([closed[:-1], closed[1:]], axis=1)])
    return found


def runs(new: np.ndarray, joined: np.ndarray) -> Iterator[tuple[int, int]]:
    """Yield the first and last index of every run of new echoes, with the known echo that it joins on either side."""
    k = 0
    while k < len(new):
        last = k
        while new[k] and last < len(joined) and joined[last] and new[last + 1]:
            last += 1
        if new[k]:
            yield k - int(k > 0 and joined[k - 1]), last + int(last < len(joined) and joined[last])
        k = last + 1


def building(file: Path, begin: float, end: float) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """Return the way (w, 2), the walls' corners (c, 2) each, and the posts (p, 2) [m]. Raises OSError, ValueError."""
    every = list(scans(file))
    if not every:
        raise ValueError(f"{file} has no front scans")
    place = np.array([pose[:2] for _, pose in every])
    driven = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(place, axis=0).T))])
    part = np.flatnonzero((driven >= begin) & (driven <= end))
    if len(part) < 2:
        raise ValueError(f"{file}: the robot drove {driven[-1]:.2f} m; no two scans from {begin:g} to {end:g} m")
    way = simplified(place[part], WAY_TOLERANCE)
    found = outlines(apart([every[k] for k in part], *APART), Grid(apart(every, *VOTE_APART)), way)
    short = [np.hypot(*np.ptp(corners, axis=0)) < LEAST_LENGTH for corners in found]
    walls = [corners for corners, post in zip(found, short, strict=True) if not post]
    posts = [corners.mean(axis=0) for corners, post in zip(found, short, strict=True) if post]
    return way, walls, np.array(posts).reshape(-1, 2)


def text(file: Path, begin: float, end: float) -> str:
    """Return a building's entry in YAML."""
    way, walls, posts = building(file, begin, end)
    name = file.name.split(".")[0]
    outlines = "".join(f"{listed(corners, 8)},\n" for corners in walls)
    return (
        f"    - # {name}, from {begin:g} to {end:g} m of the robot's way\n"
        f"      way:\n{listed(way, 8)}\n      posts:\n{listed(posts, 8)}\n      walls: [\n{outlines}        ]\n"
    )


def listed(points: np.ndarray, indent: int) -> str:
    """Return points as a list in YAML, to the centimetre, in lines of at most 120 characters; none twice in a row."""
    rounded = [tuple(point) for point in np.round(points, 2).tolist()]
    kept = rounded[:1] + [after for before, after in pairwise(rounded) if after != before]
    pairs = ", ".join(f"[{x:g},\0{y:g}]" for x, y in kept)
    lines = textwrap.wrap(pairs, 118 - indent, break_long_words=False, break_on_hyphens=False)
    return textwrap.indent("[" + "\n".join(lines) + "]", " " * indent).replace("\0", " ")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--building", nargs=3, action="append", required=True, metavar=("LOG", "BEGIN", "END"))
    parser.add_argument("--note", action="append", default=[])
    parser.add_argument("-o", "--output", type=Path, default=Path("buildings.yaml"))
    given = parser.parse_args()
    try:
        entries = [text(Path(log), float(begin), float(end)) for log, begin, end in given.building]
    except (OSError, ValueError) as error:
        parser.exit(2, f"error: {error}\n")
    notes = "".join(f"# {line}\n" for note in given.note for line in textwrap.wrap(note, 118))
    given.output.write_text(HEAD + notes + FAMILY + "".join(entries), encoding="utf-8")
    print(f"{given.output}: {given.output.stat().st_size} bytes")


if __name__ == "__main__":
    main()
