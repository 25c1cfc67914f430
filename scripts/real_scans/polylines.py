"""The joined echoes of a scan as polylines with a number of vertices in all."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

RANGE_STD = 0.015  # [m] of a SICK LMS, by its data sheet

Vertex = tuple[int, float]  # beam, range [m]
Polyline = list[Vertex]


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
