"""What perception makes of single scans of real buildings, from a log in the CARMEN format.

python scripts/real_scans.py LOG... [--scans 20] [--unexplained 0.15]     # LOG may be gzipped; prints tables

- Known: the share of echoes that are on or behind something that one scan makes known, by points (echoes that bind) and
  by lines.
- Polylines: the echoes that are joined, as polylines of a number of vertices in all. An echo is explained when its beam
  meets a polyline; the error is the measured range less the range to there. After A. Schaefer et al., "A Maximum
  Likelihood Approach to Extract Polylines from 2-D Laser Range Scans", IROS 2018, whose figures stand beside ours.
"""

from __future__ import annotations

import argparse
import gzip
import math
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pbrg_mj.perception.points.beams import SeenBeams
from pbrg_mj.perception.points.detect import add_scan
from pbrg_mj.perception.points.memory import no_points
from pbrg_mj.perception.points.parameters import PointParameters, point_parameters
from pbrg_mj.perception.scan.extract_lines import extract_lines
from pbrg_mj.perception.setup import perception_setup
from pbrg_mj.perception.track.world_frame import ScanPose
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.scene.robot import load_robot_model

VERTICES = (10, 20, 30, 50)
PLE_PLUS = {10: (0.81, 0.078), 20: (0.94, 0.061), 30: (0.97, 0.046), 50: (0.98, 0.018)}  # f and RMSE, published
RANGE_STD = 0.015  # [m] of a SICK LMS, by its data sheet
LIMITS = (8.0, 50.0, 81.9)  # [m] what these scanners report for no echo
TOLERANCE = 0.05  # [m] an echo on a line may be so far before it
DEAR = 0.5  # [m] a polyline goes when its echoes would be as far off as this otherwise


Vertex = tuple[int, float]  # beam, range [m]
Polyline = list[Vertex]


class Log(NamedTuple):
    """Scans over half a turn, from right to left."""

    ranges: np.ndarray  # (scans, beams) [m], NaN for no echo
    angles: np.ndarray  # (beams,) from straight ahead [rad]


def read_carmen(path: Path) -> Log:
    """Return the scans of the front laser. Raises ValueError for a log without any, or with scans of several sizes."""
    with gzip.open(path, "rt") if path.suffix == ".gz" else path.open() as lines:
        scans = [_ranges(line.split()) for line in lines if line.startswith("FLASER ")]
    if not scans or len({len(scan) for scan in scans}) > 1:
        raise ValueError(f"{path} has no FLASER lines, or scans of several sizes")
    ranges = np.array(scans)
    limit = next((one for one in LIMITS if np.nanmax(ranges) < one + 1.0), math.inf)
    ranges[(ranges >= limit - 0.2) | (ranges <= 0.0)] = np.nan
    step = math.pi / (len(ranges[0]) - len(ranges[0]) % 2)  # 180 or 181 beams are one degree apart
    return Log(ranges, -math.pi / 2 + step * np.arange(len(ranges[0])))


def _ranges(words: list[str]) -> list[float]:
    count = int(words[1])
    return [float(word) for word in words[2 : 2 + count]]


def scenario_of(log: Log) -> Scenario:
    """A robot with such a scanner."""
    beams = {
        "count": len(log.angles),
        "start_deg": -90.0,
        "sweep_deg": math.degrees(log.angles[-1] - log.angles[0]),
        "range_min": 0.0,
        "range_max": 1000.0,
        "noise_std": RANGE_STD,
    }
    return Scenario.model_validate(
        {
            "team": {"start": [(0, 0)], "formation": [(0, 0)], "leaders": [1]},
            "operator": {"reference": (0, 0)},
            "sensors": {"beams": beams, "camera": {"position_std": 0.0, "heading_std_deg": 0.0}},
            "estimator": {"min_points": 4},
        }
    )


def binding(ranges: np.ndarray, parameters: PointParameters) -> np.ndarray:
    """Whether each echo binds, of one scan (beams,)."""
    points = no_points(1, len(ranges))[0]
    pose = ScanPose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    beams = SeenBeams(ranges, parameters.directions)
    add_scan(points, 1, beams, pose, (np.zeros((1, 1, 2)), 0), parameters)
    bound = points[(points["live"] == 1) & (points["binds"] == 1)]
    echo = ranges * parameters.directions.T
    places = {(x, y) for x, y in zip(bound["x"].tolist(), bound["y"].tolist(), strict=True)}
    return np.array([(x, y) in places for x, y in echo.T.tolist()])


def chains(ranges: np.ndarray, angles: np.ndarray, bound: np.ndarray) -> list[np.ndarray]:
    """The beams of runs of echoes that bind, each nearer to the next than what a robot of 0.2 m passes, or two gaps."""
    gap, runs = float(angles[1] - angles[0]), []
    for k in np.flatnonzero(bound).tolist():
        if runs and _joined(ranges, angles, runs[-1][-1], k, gap):
            runs[-1].append(k)
        else:
            runs.append([k])
    return [np.array(run) for run in runs if len(run) > 1]


def _joined(ranges: np.ndarray, angles: np.ndarray, a: int, b: int, gap: float) -> bool:
    if b - a > 2:
        return False
    turn, far = angles[b] - angles[a], max(ranges[a], ranges[b])
    apart = math.sqrt(ranges[a] ** 2 + ranges[b] ** 2 - 2 * ranges[a] * ranges[b] * math.cos(turn))
    return apart <= max(2.0 * (b - a) * gap * far, 0.2) + 3.0 * math.sqrt(2.0) * RANGE_STD


def errors_between(ranges: np.ndarray, angles: np.ndarray, one: Vertex, other: Vertex) -> np.ndarray:
    """Range errors [m] of the beams from one vertex to the other, vertices given as (beam, range), ends included."""
    (a, ra), (b, rb) = one, other
    turn = angles[a : b + 1]
    # On the chord 1/r is a sine of the angle: r = ra rb sin(b - a) / (ra sin(t - a) + rb sin(b - t)).
    with np.errstate(divide="ignore", invalid="ignore"):
        predicted = (
            ra * rb * math.sin(angles[b] - angles[a]) / (ra * np.sin(turn - angles[a]) + rb * np.sin(angles[b] - turn))
        )
    return ranges[a : b + 1] - predicted


def polylines(
    ranges: np.ndarray, angles: np.ndarray, runs: list[np.ndarray], vertices: int, dear: float
) -> list[Polyline]:
    """At most so many vertices (beam, range [m]) on the beams, for the runs of echoes that are worth them most.

    All echoes are vertices first. The vertex goes, or the whole polyline, whose going costs least squared error a
    vertex, until few enough are left; an echo left unexplained counts as an error of `dear` [m]. Then each vertex moves
    along its beam to where the errors are least.
    """
    lines = [[(int(k), float(ranges[k])) for k in run] for run in runs]
    cost = [[_removal(ranges, angles, line, i, dear) for i in range(len(line))] for line in lines]
    while sum(map(len, lines)) > vertices:
        k, i = min(((k, i) for k, line in enumerate(cost) for i in range(len(line))), key=lambda at: cost[at[0]][at[1]])
        if len(lines[k]) == 2:
            del lines[k], cost[k]
            continue
        del lines[k][i], cost[k][i]
        for near in range(max(i - 2, 0), min(i + 2, len(lines[k]))):
            cost[k][near] = _removal(ranges, angles, lines[k], near, dear)
    return [_fitted(ranges, angles, line) for line in lines]


def _removal(ranges: np.ndarray, angles: np.ndarray, line: Polyline, i: int, dear: float) -> float:
    """Squared error [m^2] a vertex that goes adds; of a polyline of two, which goes whole, half of it each."""
    if len(line) == 2:
        return 0.5 * dear**2 * _echoes(ranges, line[0][0], line[1][0])
    if i in (0, len(line) - 1):
        gone, kept = (line[0], line[1]) if i == 0 else (line[-1], line[-2])
        return dear**2 * (_echoes(ranges, min(gone[0], kept[0]), max(gone[0], kept[0])) - 1)
    before, after = line[i - 1], line[i + 1]
    now = _squares(ranges, angles, before, line[i]) + _squares(ranges, angles, line[i], after)
    return _squares(ranges, angles, before, after) - now


def _echoes(ranges: np.ndarray, a: int, b: int) -> int:
    return int(np.isfinite(ranges[a : b + 1]).sum())


def _squares(ranges: np.ndarray, angles: np.ndarray, one: Vertex, other: Vertex) -> float:
    return float(np.nansum(np.minimum(errors_between(ranges, angles, one, other) ** 2, 1.0)))


def _fitted(ranges: np.ndarray, angles: np.ndarray, line: Polyline) -> Polyline:
    """The same with its vertices' ranges by least squares: in 1/r a chord is linear in its ends."""
    beams = np.array([beam for beam, _ in line])
    some = np.flatnonzero(np.isfinite(ranges[beams[0] : beams[-1] + 1])) + beams[0]
    left = np.clip(np.searchsorted(beams, some, side="right") - 1, 0, len(beams) - 2)
    a, b, t = angles[beams[left]], angles[beams[left + 1]], angles[some]
    design = np.zeros((len(some), len(beams)))
    rows = np.arange(len(some))
    design[rows, left] = np.sin(b - t) / np.sin(b - a)
    design[rows, left + 1] = np.sin(t - a) / np.sin(b - a)
    weight = ranges[some] ** 2  # an error of 1/r is that of r over r^2
    inverse, *_ = np.linalg.lstsq(design * weight[:, None], weight / ranges[some], rcond=None)
    fine = np.all(inverse > 1e-6)
    return [(int(beam), float(1.0 / one)) for beam, one in zip(beams, inverse, strict=True)] if fine else line


def explained(ranges: np.ndarray, angles: np.ndarray, lines: list[Polyline]) -> np.ndarray:
    """Range errors (beams,) [m] of the echoes whose beams meet a polyline; NaN for the others."""
    found = np.full(len(ranges), np.nan)
    for line in lines:
        for one, other in pairwise(line):
            found[one[0] : other[0] + 1] = errors_between(ranges, angles, one, other)
    return found


def behind_lines(ranges: np.ndarray, angles: np.ndarray, log: Scenario) -> np.ndarray:
    """Whether each echo is on or behind a line of the line estimator."""
    setup = perception_setup(log, 0.1)
    lines = extract_lines(ranges, setup.directions, setup.line_params)
    known = np.zeros(len(ranges), dtype=bool)
    for k in range(len(lines)):
        cosine = np.cos(angles - lines.angle[k])
        with np.errstate(divide="ignore", invalid="ignore"):
            r = np.where(cosine > 1e-3, lines.offset[k] / cosine, np.inf)
            s = r * np.sin(angles - lines.angle[k])
        meets = np.isfinite(r) & (s >= lines.low[k] - TOLERANCE) & (s <= lines.high[k] + TOLERANCE)
        known |= meets & (ranges >= r - TOLERANCE)
    return known


def measure(log: Log, scans: int, dear: float) -> Iterator[dict]:
    """Yield the figures of scans taken evenly from a log."""
    scenario = scenario_of(log)
    parameters = point_parameters(scenario, load_robot_model())
    for k in np.linspace(0, len(log.ranges) - 1, scans).astype(int).tolist():
        ranges = log.ranges[k]
        echoes = np.isfinite(ranges)
        if echoes.sum() < 10:
            continue
        bound = binding(ranges, parameters)
        row: dict = {
            "points": float(bound[echoes].mean()),
            "lines": float(behind_lines(ranges, log.angles, scenario)[echoes].mean()),
        }
        runs = chains(ranges, log.angles, bound)
        for vertices in VERTICES:
            error = explained(ranges, log.angles, polylines(ranges, log.angles, runs, vertices, dear))[echoes]
            some = error[np.isfinite(error)]
            row[vertices] = (len(some) / len(error), float(np.sqrt(np.mean(some**2))) if len(some) else math.nan)
        yield row


def table(rows: list[dict]) -> str:
    """The medians over all scans, as a page has them."""
    known = {name: float(np.median([row[name] for row in rows])) for name in ("points", "lines")}
    text = f"{len(rows)} scans; known in one scan: points {known['points']:.3f}, lines {known['lines']:.3f}\n\n"
    text += "| vertices | explained | RMSE [m] | PLE+: explained | RMSE [m] |\n|---|---|---|---|---|\n"
    for vertices in VERTICES:
        f, rmse = (float(np.nanmedian([row[vertices][i] for row in rows])) for i in (0, 1))
        theirs = PLE_PLUS[vertices]
        text += f"| {vertices} | {f:.2f} | {rmse:.3f} | {theirs[0]:.2f} | {theirs[1]:.3f} |\n"
    return text


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", nargs="+", type=Path, metavar="LOG")
    parser.add_argument("--scans", type=int, default=20, help="of each log")
    parser.add_argument("--unexplained", type=float, default=0.15, help="error that an echo left out counts as [m]")
    args = parser.parse_args()
    print(table([row for path in args.logs for row in measure(read_carmen(path), args.scans, args.unexplained)]))


if __name__ == "__main__":
    main()
