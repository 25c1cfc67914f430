"""The compiled tracks against plain numpy, on random walks past random walls."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from pbrg_mj.perception.track.records import no_tracks
from pbrg_mj.perception.track.update import update_tracks
from pbrg_mj.perception.track.world_frame import LINE, ScanPose
from tests import track_oracle as oracle
from tests.perceiving import scenario, setup

PARAMS = setup(scenario(estimator={"memory": 2.0})).parameters.track._replace(silent=2)
PERIOD, SCANS = 0.1, 60
SILENT = np.full(8, np.nan), np.column_stack([np.cos(np.arange(8.0)), np.sin(np.arange(8.0))])  # ranges, directions
COLUMNS = ("angle", "offset", "low", "high", "c_aa", "c_ac", "c_cc", "e_aa", "e_ac", "e_cc")
EXACT = {"rel": 1e-7, "abs": 1e-9}  # inverses of matrices there, closed forms here


class Walk:
    """A robot that wanders between walls that face it or are behind it, and sees noisy parts of them."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        count = int(self.random.integers(1, 5))
        self.angle = self.random.choice([0.0, np.pi], count) + self.random.uniform(-0.12, 0.12, count)
        self.offset = self.random.uniform(0.5, 2.5, count)
        self.at, self.jumps = np.zeros(2), np.zeros(count)
        self.still = self.random.uniform() < 0.5

    def scan(self, k: int) -> tuple[np.ndarray, ScanPose]:
        shift = self.random.normal(0, 0.02, 2) if k else np.zeros(2)
        self.at = self.at + shift
        self.jumps += self.random.choice([0.0, 0.12], len(self.jumps), p=[0.97, 0.03]) * (not self.still)
        lines = [line for wall in range(len(self.angle)) for line in self.lines(wall)]
        self.random.shuffle(lines)
        records = np.zeros(len(lines), LINE)
        for name, values in zip(COLUMNS, np.array(lines).reshape(-1, 10).T, strict=True):
            records[name] = values
        records["track"] = -1
        time, elapsed = k * PERIOD, PERIOD if k else 0.0
        (x, y), (shift_x, shift_y) = self.at.tolist(), shift.tolist()
        return records, ScanPose(x, y, 0.0, 1e-6, 1e-5, shift_x, shift_y, time, elapsed)

    def lines(self, wall: int) -> list[tuple[float, ...]]:
        """What is seen of a wall: nothing, its whole extent, or two parts of it."""
        if self.random.uniform() < 0.25:
            return []
        low, cut, high = np.sort(self.random.uniform(-1.0, 1.0, 3)) + np.array([-0.1, 0.0, 0.1])
        parts = [(low, cut - 0.1), (cut + 0.1, high)] if self.random.uniform() < 0.3 else [(low, high)]
        return [self.line(wall, *part) for part in parts]

    def line(self, wall: int, low: float, high: float) -> tuple[float, ...]:
        root = self.random.normal(0, 1, (2, 2)) * [[0.004], [0.003]]
        R = root @ root.T + np.diag([2e-6, 1e-6])
        error = np.linalg.cholesky(R) @ self.random.standard_normal(2)
        angle = self.angle[wall] + error[0]
        offset = self.offset[wall] + self.jumps[wall] - oracle.normal_of(self.angle[wall]) @ self.at + error[1]
        of_error = 0.6 * R[0, 0], 0.3 * R[0, 1], 0.8 * R[1, 1]
        return (angle, max(offset, 0.01), low, high, R[0, 0], R[0, 1], R[1, 1], *of_error)


def test_the_compiled_tracks_are_those_of_plain_numpy() -> None:
    met: Counter[str] = Counter()
    for seed in range(25):
        walk, tracks, plain = Walk(seed), no_tracks(1, 2)[0], list[oracle.Track]()
        for k in range(SCANS):
            (lines, pose), before = walk.scan(k), [track for track in plain if track.live]
            update_tracks(tracks, lines, SILENT, pose, PARAMS)
            met.update(oracle.update_tracks(plain, lines, pose, PARAMS, len(tracks)))
            met["dropped or merged"] += sum(not track.live for track in before)
            assert np.flatnonzero(tracks["live"]).tolist() == [i for i, track in enumerate(plain) if track.live]
            for row, track in zip(tracks, plain, strict=False):
                if track.live:
                    met["confirmed" if track.confirmed else "not yet confirmed"] += 1
                    assert_same(row, track)
    assert len(met) == 7 and min(met.values()) > 20  # all that can happen did


def assert_same(row: np.void, track: oracle.Track) -> None:
    counts = ("confirmed", "hits", "unseen", "conflicts")
    assert [row[name] for name in counts] == [getattr(track, name) for name in counts]
    assert abs(oracle.turned(row["angle"] - track.x[0])) < 1e-9
    assert row["offset"] == pytest.approx(track.x[1], **EXACT)
    assert row["p_aa"] == pytest.approx(track.P[0, 0], rel=1e-7)
    assert row["p_ac"] == pytest.approx(track.P[0, 1], rel=1e-7, abs=1e-14)
    assert row["p_cc"] == pytest.approx(track.P[1, 1], rel=1e-7)
    for name, C in (("e_aa", track.C[0, 0]), ("e_ac", track.C[0, 1]), ("e_cc", track.C[1, 1]), ("away", track.away)):
        assert row[name] == pytest.approx(C, rel=1e-7, abs=1e-14)
    assert (row["low"], row["high"]) == pytest.approx(track.extent, **EXACT)
    assert row["seen"] == track.seen


def one_line(time: float) -> tuple[np.ndarray, ScanPose]:
    """A wall 1 m ahead, seen by a robot at rest."""
    record = np.zeros(1, LINE)
    for name, value in zip(COLUMNS, (0.0, 1.0, -0.8, 0.8, 1e-4, 1e-5, 4e-5, 5e-5, 5e-6, 2e-5), strict=True):
        record[name] = value
    record["track"] = -1
    return record, ScanPose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, time, PERIOD)


@pytest.mark.parametrize(("met", "counted"), [(True, 6), (False, 8)])
def test_a_scan_that_met_a_wall_and_shows_no_line_takes_a_sighting_back(met: bool, counted: int) -> None:
    """What is no line in most scans is one in others because of their noise, so these are wrong alike."""
    steady, beams = PARAMS._replace(drift=0.0, turn=0.0), np.linspace(-0.6, 0.6, 12)
    directions = np.column_stack([np.cos(beams), np.sin(beams)])
    echoes = 1.0 / np.cos(beams) if met else np.full(12, 0.3)  # the others are stopped before it
    tracks = no_tracks(1, 2)[0]
    for k in range(10):
        lines, pose = one_line(k * PERIOD)
        update_tracks(tracks, lines[:0] if k in (4, 7) else lines, (echoes, directions), pose, steady)
    track = tracks[tracks["live"] == 1][0]
    assert (track["hits"], track["missed"]) == (8, 2 if met else 0)
    assert track["p_aa"] == pytest.approx(1e-4 / counted, rel=0.06)
    assert track["p_cc"] == pytest.approx(4e-5 / counted, rel=0.06)
    assert track["e_aa"] == pytest.approx(0.5 * track["p_aa"])
