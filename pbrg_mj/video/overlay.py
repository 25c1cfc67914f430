"""What the picture shows beside the scene: beams, half-spaces, the network, references, trails."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pbrg_mj.log.read.run import Run
from pbrg_mj.log.read.scans import ScanSeries
from pbrg_mj.scenario.schema import edge_list
from pbrg_mj.video.camera import Camera
from pbrg_mj.video.markers import Markers
from pbrg_mj.video.playback import Motion, between, held, latest

# Heights above the floor [m]: what lies on what.
SHADOW, SIDE, TRAIL, GOAL, EDGE, BOUNDARY, MARK = 0.0022, 0.003, 0.004, 0.0045, 0.005, 0.006, 0.007
ON_TOP = 0.08
APART = 0.0004  # between marks of the same kind that would flicker through each other [m]
SHADOW_COLOUR = (0.0, 0.0, 0.0, 0.22)
EDGE_COLOUR = (0.25, 0.27, 0.32, 0.7)
OPTIMUM_COLOUR = (0.05, 0.05, 0.05, 1.0)
REFERENCE_COLOUR = (0.85, 0.08, 0.12, 1.0)
STAR_ANGLES = np.pi * np.array([0.5, 5 / 6, 7 / 6])  # of the bars of r [rad]
MOST_BEAMS = 36  # drawn of a robot's scan: more are moire
HIT_SIZE = 0.18  # of a beam's end [marks]
TRAIL_SECONDS, TRAIL_STEP = 15.0, 0.5  # [s]
STILL = 1e-4  # pieces of trails that are shorter are not seen [m]
NEAR = 25.0  # from the team, beyond which nothing is marked [m]
MAX_RINGS = 8  # robots whose references can be told apart as rings around each other


@dataclass(frozen=True)
class FrameState:
    """One frame's view of the run."""

    time: float  # [s]
    tick: int  # the latest
    camera: Camera


class Overlay:
    """Draws the chosen layers of a run, each a function of time alone."""

    def __init__(self, run: Run, scans: dict[int, ScanSeries], motion: Motion, colour: np.ndarray):
        """`colour` (n, 4) are the robots' own."""
        self._run, self._scans, self._motion = run, scans, motion
        self._colour = colour
        self._edges = edge_list(run.scenario.graph, run.scenario.robots)
        self._hand, self._m = held(run.ticks.hand_true), held(run.ticks.m)
        self._formation = np.array(run.scenario.team.formation)
        self._trail = trail(run.ticks.time, self._hand)

    def draw(self, markers: Markers, frame: FrameState, layers: frozenset[str]) -> None:
        """Add the layers to the scene that `markers` draws into; shadows always."""
        self._shadows(markers, frame)
        drawn: dict[str, Callable[[Markers, FrameState], None]] = {
            "half_spaces": self._half_spaces,
            "trails": self._trails,
            "formation": self._network,
            "references": self._references,
            "beams": self._beams,
        }
        for name, draw in drawn.items():
            if name in layers:
                draw(markers, frame)

    def _shadows(self, markers: Markers, frame: FrameState) -> None:
        """Put a shade under every robot: it sets robots on the floor at a fraction of a shadow map's cost."""
        for x, y, _ in self._motion.at(frame.time)[0].tolist():
            markers.disc(np.array([x + 0.008, y + 0.012, SHADOW]), 0.068, SHADOW_COLOUR)

    def _half_spaces(self, markers: Markers, frame: FrameState) -> None:
        """Draw each sensed line G q = h for hand points in its robot's colour, shaded on the side that is forbidden."""
        ticks, k = self._run.ticks, frame.tick
        middle = self._hand[k].mean(axis=0)
        depth = 6 * frame.camera.mark
        for count, (robot, slot) in enumerate(np.argwhere(ticks.half_space_active[k])):
            G, h = ticks.half_space_G[k, robot, slot], ticks.half_space_h[k, robot, slot]
            distance = float(h - G @ middle)
            if not abs(distance) < NEAR:
                continue
            foot, angle = middle + distance * G, float(np.arctan2(G[1], G[0])) + np.pi / 2
            colour, lift = self._colour[robot], count * APART
            side, edge = _above(foot + depth * G, SIDE + lift), _above(foot, BOUNDARY + lift)
            markers.bar(side, (NEAR, depth), angle, (*colour[:3], 0.16))
            markers.bar(edge, (NEAR, 0.16 * frame.camera.mark), angle, (*colour[:3], 0.95))

    def _trails(self, markers: Markers, frame: FrameState) -> None:
        knots, places = self._trail
        first, last = np.searchsorted(knots, [frame.time - TRAIL_SECONDS, frame.time])
        now = _on_the_floor(between(self._run.ticks.time, self._hand, frame.time))
        times = np.append(knots[first:last], frame.time)
        paths = np.concatenate([places[first:last], now[None]])
        fades = 0.85 * (1 - (frame.time - times) / TRAIL_SECONDS)
        moved = np.linalg.norm(np.diff(paths, axis=0), axis=-1) > STILL
        for piece, robot in np.argwhere(moved).tolist():
            markers.line(
                paths[piece, robot], paths[piece + 1, robot], 3.0, (*self._colour[robot][:3], float(fades[piece + 1]))
            )

    def _network(self, markers: Markers, frame: FrameState) -> None:
        """Join neighbours in the network, and show the formation's shape."""
        q = between(self._run.ticks.time, self._hand, frame.time)
        for i, j in self._edges:
            markers.line(_above(q[i], EDGE), _above(q[j], EDGE), 1.5, EDGE_COLOUR)

    def _references(self, markers: Markers, frame: FrameState) -> None:
        """Mark m_j (discs), where each sends its robot (shades), m* (a cross) and r (a star)."""
        run, size = self._run, frame.camera.mark
        m = between(run.ticks.time, self._m, frame.time)
        n = len(m)
        base = ON_TOP if frame.camera.orthographic else MARK  # from above nothing slides; robots hide nothing then
        for j, colour in enumerate(self._colour):
            ring = size * (1 - 0.7 * j / n) if n <= MAX_RINGS else 0.6 * size
            markers.disc(_above(m[j], base + j * APART), ring, (*colour[:3], 1.0))
            markers.disc(_above(m[j] + self._formation[j], GOAL), 0.05, (*colour[:3], 0.3))
        top = base + n * APART
        solved = latest(run.optima.time, frame.time)
        if solved >= 0 and np.isfinite(run.optima.m[solved]).all():
            star = _above(run.optima.m[solved], top + APART)
            markers.star(star, 1.5 * size, np.pi * np.array([0.25, 0.75]), OPTIMUM_COLOUR)
        reference = _above(run.ticks.reference[frame.tick], top + 2 * APART)
        markers.star(reference, 1.5 * size, STAR_ANGLES, REFERENCE_COLOUR)

    def _beams(self, markers: Markers, frame: FrameState) -> None:
        """Draw each robot's latest scan from where it was taken; a beam that returned nothing is left out."""
        for robot, scans in self._scans.items():
            k = latest(scans.time, frame.time)
            if k < 0:
                continue
            x, y, heading = between(self._motion.time, self._motion.pose[:, robot], float(scans.time[k]))
            start = np.array([x, y, self._run.scenario.sensors.beams.height])
            drawn = drawn_beams(len(scans.angles))
            ranges, angles = scans.ranges[k][drawn], heading + scans.angles[drawn]
            ends = start + ranges[:, None] * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
            colour = self._colour[robot]
            for end in ends[np.isfinite(ranges)]:
                markers.line(start, end, 1.0, (*colour[:3], 0.35))
                markers.dot(end, HIT_SIZE * frame.camera.mark, (*colour[:3], 1.0))


def drawn_beams(count: int) -> slice:
    """Return which of a scan's beams are drawn: every one of a few, evenly spaced ones of many."""
    return slice(0, count, -(-count // MOST_BEAMS))


def trail(time: np.ndarray, hand: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the times (K,) at which trails are bent, and the places (K, n, 3) on the floor then.

    They are the same in every frame, so that a path stays still while it fades.
    """
    count = int((time[-1] - time[0]) / TRAIL_STEP) + 1
    knots = time[0] + TRAIL_STEP * np.arange(count)
    return knots, _on_the_floor(np.array([between(time, hand, knot) for knot in knots.tolist()]))


def _on_the_floor(places: np.ndarray) -> np.ndarray:
    """Return places (..., 2) with the height (..., 3) of trails."""
    return np.concatenate([places, np.full((*places.shape[:-1], 1), TRAIL)], axis=-1)


def _above(point: np.ndarray, height: float) -> np.ndarray:
    return np.array([point[0], point[1], height])
