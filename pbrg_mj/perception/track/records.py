"""The record of a track: one row of `TRACK` for each line that a robot tracks.

All geometry of a track is about its robot's estimated position at the last scan, the anchor, and never about the
world's origin: far from it, an angle's error would swamp the offset. The line is n . (q - anchor) = offset with n =
(cos angle, sin angle) in the world, seen from the side n . (q - anchor) < offset, and coordinates along it are along
t = (-sin angle, cos angle).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.parameters import blind_range, in_metres, least_points
from pbrg_mj.scenario.schema import Scenario

_REAL = ["angle", "offset", "p_aa", "p_ac", "p_cc", "e_aa", "e_ac", "e_cc", "away"]
_REAL += ["low", "high", "low_bound", "high_bound", "first", "seen"]
_REAL += ["ref_angle", "ref_x", "ref_y", "w0", "w1", "w2", "e0", "e1", "end_blur"]
_WHOLE = ["live", "confirmed", "slot", "hits", "missed", "unseen"]
_WHOLE += ["contradictions", "conflicts", "end_moves", "own_only"]

TRACK = np.dtype([(name, np.float64) for name in _REAL] + [(name, np.int64) for name in _WHOLE])
"""One line tracked by one robot.

- angle [rad], offset [m], and their covariance p_aa, p_ac, p_cc by which sightings are weighted: walls may drift
- e_aa, e_ac, e_cc: covariance of their errors if the wall rests; away [s]: for how long it has been out of sight
- low, high [m]: the extent seen; low_bound, high_bound [m]: beams passed by there, so the track ends before; infinite
  when no end has been seen
- first, seen [s]: first and last sighting; hits: sightings; missed: scans whose beams met it and that showed no line;
  unseen: scans since the last sighting
- ref_angle, ref_x, ref_y: line and place of the first sighting; w0, w1, w2, e0, e1: sums of 1, tau, tau^2, e, tau e,
  each weighted by 1/variance, e the displacement along the normal and tau the time since then
- end_blur [m]: how far the thing can slide along itself before its better seen end must show it
- live: in use; confirmed: it is at rest and gives half-spaces (see confirmation.py)
- evidence against it: contradictions, scans in a row in which beams went past; conflicts, lines near it but outside the
  gate; end_moves, how often an end has moved
- slot: of its half-space, -1 for none; own_only: its obstacle is kept off the own hand point alone
"""


class TrackParameters(NamedTuple):
    """Parameters of the tracks; a named tuple, so that compiled code takes it as it is."""

    range_max: float  # of the beams [m]
    blind_range: float  # a beam without an echo does not tell of what is nearer [m]
    silent: int  # neighbouring beams without an echo that cannot all have been lost
    memory: float  # how long an unseen track is kept [s]
    drift: float  # growth of an unseen track's offset [m/sqrt(s)]
    turn: float  # and angle [rad/sqrt(s)]
    clearance: float  # of hand points from faces [m]
    sigmas: float  # half-spaces move inward by this many standard deviations
    min_points: int  # of a line
    near_angle: float  # a line this near a track, but outside its gate, is a CONFLICT [rad]
    near_offset: float  # [m]
    same_angle: float  # tracks this close are one line, however sure they are [rad]
    same_offset: float  # [m]
    free_gap: float  # between two extents of one line, with a true end between [m]
    hidden_gap: float  # and without [m]
    least_overlap: float  # of a track on the line that shows it to be part of a longer line [m]
    extent_margin: float  # from the ends of the extent seen [m]
    passed_by: float  # an echo this far behind a line passed it by; so much before it, something hid it [m]
    end_tolerance: float  # by which an end may move before it counts, beside the noise of the pose [m]
    end_uncertainty: float  # how far an end may be uncertain, and ends that are hidden are [m]
    long_extent: float  # extents this long are confirmed when seen twice, and twice as long in the first scan [m]
    rest_speed: float  # things that move at least so fast are not confirmed [m/s]
    least_turn: float  # between two faces at a corner [rad]
    most_turn: float  # [rad]
    corner_reach: float  # a corner may lie so far inside the extent seen, and twice that beyond [m]
    corner_tolerance: float  # a face lies so far behind the other's line, at a convex corner [m]
    face_depth: float  # what is behind a single face is taken for solid so deep [m]
    team_gap: float  # gap from which on an obstacle is kept off the whole team again [m]
    slot_hysteresis: float  # an obstacle displaces another only if it is nearer by this much [m]


@kernel
def error_covariance(track, params):
    """Return aa, ac, cc of the errors' covariance: of a wall at rest, and of its drift while it is out of sight."""
    away = track["away"]
    return track["e_aa"] + away * params.turn**2, track["e_ac"], track["e_cc"] + away * params.drift**2


def track_parameters(scenario: Scenario, agree: int, clearance: float) -> TrackParameters:
    """Return the parameters for a scenario; `agree` neighbouring beams are not lost together."""
    estimator, given = scenario.estimator, scenario.estimator.thresholds
    return TrackParameters(
        range_max=scenario.sensors.beams.range_max,
        blind_range=blind_range(scenario),
        silent=agree if scenario.assumed_sensors.beams.dropout > 0 else 1,
        memory=estimator.memory,
        drift=estimator.drift_std,
        turn=float(np.deg2rad(estimator.drift_std_deg)),
        clearance=clearance,
        sigmas=estimator.sigmas,
        min_points=least_points(scenario),
        near_angle=math.radians(given.near_deg),
        near_offset=in_metres(given.near_offset, clearance),
        same_angle=math.radians(given.same_deg),
        same_offset=given.same_offset,
        free_gap=in_metres(given.free_gap, clearance),
        hidden_gap=in_metres(given.hidden_gap, clearance),
        least_overlap=in_metres(given.least_overlap, clearance),
        extent_margin=in_metres(given.extent_margin, clearance),
        passed_by=in_metres(given.passed_by, clearance),
        end_tolerance=given.end_tolerance,
        end_uncertainty=in_metres(given.end_uncertainty, clearance),
        long_extent=given.long_extent,
        rest_speed=given.rest_speed,
        least_turn=math.radians(given.outline_least_deg),
        most_turn=math.radians(given.outline_most_deg),
        corner_reach=in_metres(given.corner_reach, clearance),
        corner_tolerance=given.corner_tolerance,
        face_depth=in_metres(given.face_depth, clearance),
        team_gap=in_metres(given.team_gap, clearance),
        slot_hysteresis=in_metres(given.slot_hysteresis, clearance),
    )


def no_tracks(robots: int, slots: int) -> np.ndarray:
    """Return empty tracks (robots, M): an obstacle may show two faces and some tracks are not yet confirmed."""
    tracks = np.zeros((robots, 2 * slots + 4), dtype=TRACK)
    tracks["slot"] = -1
    return tracks
