"""How far off a wall at rest is, whatever it is that its sightings are weighted by."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from pbrg_mj.perception.track.records import TrackParameters, error_covariance, no_tracks
from pbrg_mj.perception.track.update import update_tracks
from pbrg_mj.perception.track.world_frame import LINE, ScanPose
from tests.perceiving import scenario, setup

DRIFTS = setup(scenario()).parameters.track._replace(silent=2)
RESTS = DRIFTS._replace(drift=0.0, turn=0.0)
NOTHING = np.full(8, np.nan), np.column_stack([np.cos(np.arange(8.0)), np.sin(np.arange(8.0))])  # ranges, directions
PERIOD, SPEED, OFFSET = 0.1, 0.2, 1.5  # [s], [m/s], [m]
R = np.array([[4e-5, 6e-6], [6e-6, 2e-6]])  # by which sightings are weighted
TRULY = np.array([[2e-5, 2e-6], [2e-6, 1e-6]])  # of their errors


def sighting(error: np.ndarray, of_error: np.ndarray, k: int) -> tuple[np.ndarray, ScanPose]:
    """Scan k of a robot that drives beside the wall x = 1.5 and away from it, with an error of (angle, offset)."""
    way, shift = np.array([-0.5, 1.0]) * SPEED * PERIOD * k, np.array([-0.5, 1.0]) * SPEED * PERIOD * (k > 0)
    line = np.zeros(1, LINE)
    line["angle"], line["offset"] = error[0], OFFSET - way[0] + error[1]
    line["c_aa"], line["c_ac"], line["c_cc"] = R[0, 0], R[0, 1], R[1, 1]
    line["e_aa"], line["e_ac"], line["e_cc"] = of_error[0, 0], of_error[0, 1], of_error[1, 1]
    line["low"], line["high"], line["track"] = -1.0, 1.0, -1
    return line, ScanPose(way[0], way[1], 0.0, 0.0, 0.0, shift[0], shift[1], PERIOD * k, PERIOD * (k > 0))


def follow(seen: list[bool], of_error: np.ndarray, params: TrackParameters, random: np.random.Generator) -> np.void:
    """The track of the wall after scans that show it or not."""
    root, tracks = np.linalg.cholesky(of_error), no_tracks(1, 2)[0]
    for k, shown in enumerate(seen):
        line, pose = sighting(root @ random.standard_normal(2), of_error, k)
        update_tracks(tracks, line if shown else line[:0], NOTHING, pose, params)
    assert tracks["live"].sum() == 1
    return tracks[0]


def squares(track: np.void, scans: int) -> tuple[float, float]:
    """Normalised errors squared by the covariance of the errors, and by the filter's."""
    error = np.array([track["angle"], track["offset"] - OFFSET - 0.5 * SPEED * PERIOD * (scans - 1)])
    aa, ac, cc = error_covariance(track, DRIFTS)
    C = np.array([[aa, ac], [ac, cc]])
    P = np.array([[track["p_aa"], track["p_ac"]], [track["p_ac"], track["p_cc"]]])
    return float(error @ np.linalg.solve(C, error)), float(error @ np.linalg.solve(P, error))


def test_the_error_of_a_wall_at_rest_has_the_covariance_that_is_told() -> None:
    """Sightings are weighted for a wall that drifts, one scan in three shows none, and their noise is less than R."""
    random = np.random.default_rng(11)
    seen = [k % 3 != 1 for k in range(30)]
    found = np.array([squares(follow(seen, TRULY, DRIFTS, random), len(seen)) for _ in range(1500)])
    low, high = chi2.ppf([0.005, 0.995], 2 * len(found)) / len(found)
    told, filtered = found.mean(axis=0)
    assert low < told < high
    assert filtered < 0.75 * low


def test_without_drift_and_with_the_true_noise_it_is_the_filters_own() -> None:
    """The filter's gain is then the best one, and its covariance the errors' (Kalman); of c R it is c times that."""
    for share in (1.0, 0.3):
        track = follow([True] * 12, share * R, RESTS, np.random.default_rng(3))
        for name in ("aa", "ac", "cc"):
            assert track[f"e_{name}"] == pytest.approx(share * track[f"p_{name}"], rel=1e-9)


def test_a_wall_that_beams_meet_is_in_sight_though_it_shows_no_line() -> None:
    """Out of sight its drift counts from the last scan that met it, and no longer once it is seen again."""
    beams = np.linspace(-0.4, 0.4, 12)
    directions = np.column_stack([np.cos(beams), np.sin(beams)])
    tracks, random = no_tracks(1, 2)[0], np.random.default_rng(5)
    for k in range(12):
        line, pose = sighting(1e-3 * random.standard_normal(2), TRULY, k)
        met = (OFFSET - pose.x) / directions[:, 0], directions
        shown = line if k < 5 or k > 10 else line[:0]
        update_tracks(tracks, shown, met if k < 7 else NOTHING, pose, DRIFTS)
        aa, _, cc = error_covariance(tracks[0], DRIFTS)
        away = PERIOD * max(0, k - 6) if k <= 10 else 0.0
        assert tracks[0]["away"] == pytest.approx(away)
        assert aa - tracks[0]["e_aa"] == pytest.approx(away * DRIFTS.turn**2, abs=1e-15)
        assert cc - tracks[0]["e_cc"] == pytest.approx(away * DRIFTS.drift**2, abs=1e-15)
