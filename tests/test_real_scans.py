"""The reader of CARMEN logs, and what the table counts, on a room whose answers are known."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from scripts.real_scans.__main__ import main
from scripts.real_scans.carmen import read_carmen
from scripts.real_scans.measure import VERTICES, behind_lines, measure, scenario_of
from scripts.real_scans.polylines import polylines
from tests.raycast import Scene, cast

ROOM = Scene(((3.0, -2.0, 3.0, 2.0), (3.0, 2.0, -1.0, 2.0), (3.0, -2.0, -1.0, -2.0)))
BEAMS = 181


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """Three scans of a room, 181 beams over half a turn; a beam without an echo reads 81.83 m."""
    ranges = cast(ROOM, np.array([0.0, 0.0, -np.pi / 2]), 360, 100.0)[:BEAMS]
    ranges[60:70] = np.nan
    words = " ".join(f"{r:.3f}" for r in np.nan_to_num(ranges, nan=81.83))
    line = f"FLASER {BEAMS} {words} 0 0 0 0 0 0 1.0 host 1.0"
    path = tmp_path / "room.log"
    path.write_text("\n".join(["# a comment", "ODOM 0 0 0 0 0 0 1.0 host 1.0", line, line, line]))
    return path


def test_a_log_is_read_from_right_to_left_with_no_echo_as_nan(log: Path) -> None:
    read = read_carmen(log)
    assert read.ranges.shape == (3, BEAMS)
    np.testing.assert_allclose(np.rad2deg(read.angles), np.arange(-90, 91), atol=1e-9)
    assert np.isnan(read.ranges[0, 60:70]).all() and np.isnan(read.ranges[0]).sum() == 10
    assert read.ranges[0, [0, 90, 180]] == pytest.approx([2.0, 3.0, 2.0], abs=1e-3)


@pytest.mark.parametrize("text", ["", "ODOM 0 0", "FLASER 2 1 1 0\nFLASER 3 1 1 1 0\n"])
def test_a_log_without_scans_of_one_size_says_so(tmp_path: Path, text: str) -> None:
    path = tmp_path / "bad.log"
    path.write_text(text)
    with pytest.raises(ValueError, match="has no FLASER lines, or scans of several sizes"):
        read_carmen(path)


def test_a_room_is_known_wholly_and_its_polylines_are_its_walls(log: Path) -> None:
    read = read_carmen(log)
    (row, *_) = measure(read, 2, 0.15)
    assert row["points"] == 1.0 and row["lines"] > 0.97
    for vertices in VERTICES:
        share, rmse = row[vertices]
        assert share == 1.0 and rmse < (0.01 if vertices == 10 else 0.002)  # a degree beside each of two corners
    echoes = np.flatnonzero(np.isfinite(read.ranges[0]))
    runs = [echoes[echoes < 60], echoes[echoes > 60]]
    four = polylines(read.ranges[0], read.angles, runs, 6, 0.15)
    assert sum(map(len, four)) == 6 and all(line[0][0] in (0, 70) for line in four)


def test_echoes_behind_lines_are_known_and_those_beside_them_are_not(log: Path) -> None:
    read = read_carmen(log)
    ranges = read.ranges[0].copy()
    ranges[90] += 1.0  # through the wall ahead
    ranges[100] = 0.5  # before it
    known = behind_lines(ranges, read.angles, scenario_of(read))
    assert known[90] and not known[100] and known.mean() > 0.9


def test_the_table_names_what_is_published_beside_ours(
    log: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["real_scans", str(log), "--scans", "2"])
    main()
    printed = capsys.readouterr().out
    assert printed.startswith("2 scans; known in one scan: points 1.000")
    assert "| 50 | 1.00 |" in printed and printed.count("\n|") == 6 and "| 0.98 | 0.018 |" in printed
