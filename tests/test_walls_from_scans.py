"""Laser logs of buildings as scenarios and families: a log that a known room would make gives that room."""

from __future__ import annotations

import gzip
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pbrg_mj.scenario.load import load_scenario

SCRIPTS = Path(__file__).parents[1] / "scripts"
LOW, HIGH = np.array([-2.0, -1.5]), np.array([5.0, 2.0])  # of a room, in the log's frame [m]
PASSER_BY = np.array([2.2, -0.7])  # stands there in three scans


@pytest.fixture(autouse=True)
def _found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(SCRIPTS)


def ranges(place: np.ndarray, heading: float, random: np.random.Generator, n: int) -> np.ndarray:
    """What a laser reads in the room, with noise of 1 cm; its doorway, 1 m wide at the far end, has no echo."""
    from walls_from_scans import bearings

    angle = heading + bearings(n)
    ray = np.column_stack([np.cos(angle), np.sin(angle)])
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(ray >= 0, (HIGH - place) / ray, (LOW - place) / ray)
    nearest = reach.min(axis=1)
    at = place + nearest[:, None] * ray
    door = (at[:, 0] > HIGH[0] - 1e-6) & (np.abs(at[:, 1]) < 0.5)
    return np.where(door, 81.83, nearest + random.normal(0.0, 0.01, n))


def log(folder: Path, heading: float = 0.0, n: int = 180) -> Path:
    """A log of a robot that drives 3 m along the room and sees somebody in its way once, and thrice beside it."""
    from walls_from_scans import bearings

    random, lines = np.random.default_rng(4), ["# a log\n", "PARAM x y\n"]
    for k in range(13):
        place = np.array([0.25 * k, 0.0])
        read = ranges(place, heading, random, n)
        if k == 4:
            read[n // 2 - 3 : n // 2 + 3] = 0.8
        if k in (5, 6, 7):
            off = PASSER_BY - place
            read[np.abs(heading + bearings(n) - np.arctan2(off[1], off[0])) < 0.05] = np.hypot(*off)
        pose = [*place, heading]
        lines.append(" ".join(["FLASER", str(n), *(f"{one:.3f}" for one in read), *map(str, pose * 2), "0 host 0\n"]))
    file = folder / "room.log.gz"
    with gzip.open(file, "wt") as text:
        text.writelines(lines)
    return file


def from_room(points: np.ndarray) -> np.ndarray:
    """Distances of points from the room's walls."""
    return np.minimum(np.abs(points - LOW), np.abs(points - HIGH)).min(axis=1)


@pytest.mark.parametrize("n", [180, 181, 360, 361])
def test_walls_are_those_of_the_room_and_nothing_stands_in_its_doorway_or_on_the_way(tmp_path, n):
    from walls_from_scans import scenario

    data = scenario(log(tmp_path, n=n), 0, 3, 2.5, 8.0)
    ends = np.array([[wall["from"], wall["to"]] for wall in data["world"]["walls"]])
    points = (ends[:, None, 0] + np.linspace(0, 1, 20)[:, None] * (ends[:, None, 1] - ends[:, None, 0])).reshape(-1, 2)
    posts = np.array([one["center"] for one in data["world"]["columns"]]).reshape(-1, 2)
    assert from_room(np.concatenate([points, posts])).max() < 0.05
    in_door = (points[:, 0] > HIGH[0] - 0.1) & (np.abs(points[:, 1]) < 0.35)
    assert not in_door.any()
    seen = np.array([[x, y] for x in np.linspace(0.2, 4.8, 30) for y in (LOW[1], HIGH[1])])
    assert np.linalg.norm(seen[:, None] - points, axis=-1).min(axis=1).max() < 0.25
    assert data["operator"]["reference"] == [2.5, 0.0]


def test_the_frame_is_that_of_the_first_pose(tmp_path):
    from walls_from_scans import scenario

    data = scenario(log(tmp_path, heading=0.3), 2, 1, 2.0, 8.0)
    np.testing.assert_allclose(data["operator"]["reference"], [2.0 * np.cos(0.3), -2.0 * np.sin(0.3)], atol=2e-3)


def test_the_script_writes_a_scenario_that_loads(tmp_path):
    file, output = log(tmp_path), tmp_path / "room.yaml"
    command = [sys.executable, str(SCRIPTS / "walls_from_scans.py"), str(file), "-o", str(output)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert load_scenario(output).scenario.robots == 3
    late = subprocess.run([*command, "--scan", "50"], capture_output=True, text=True, check=False)
    assert (late.returncode, late.stderr.count("\n")) == (2, 1) and "there is no scan 50" in late.stderr


def test_a_building_is_put_together_from_all_scans_without_what_moved(tmp_path):
    from building_family import building

    way, walls, posts = building(log(tmp_path), 0.0, 3.0)
    np.testing.assert_allclose(way, [[0.0, 0.0], [3.0, 0.0]], atol=1e-9)
    sides = np.concatenate([np.stack([corners[:-1], corners[1:]], axis=1) for corners in walls])
    points = (sides[:, None, 0] + np.linspace(0, 1, 20)[:, None] * (sides[:, None, 1] - sides[:, None, 0])).reshape(
        -1, 2
    )
    assert from_room(np.concatenate([points, posts])).max() < 0.05
    assert not ((points[:, 0] > HIGH[0] - 0.1) & (np.abs(points[:, 1]) < 0.35)).any()  # the doorway
    # Scans look ahead: of what lies behind the place of the third there are too few.
    seen = np.array([[x, y] for x in np.linspace(0.55, 4.8, 30) for y in (LOW[1], HIGH[1])])
    assert np.linalg.norm(seen[:, None] - points, axis=-1).min(axis=1).max() < 0.25
    around = 2 * (HIGH - LOW).sum() - 1.0 - (HIGH - LOW)[1]  # without the doorway and the wall behind
    assert np.hypot(*(sides[:, 1] - sides[:, 0]).T).sum() < 1.05 * around  # none twice
    np.testing.assert_allclose(building(log(tmp_path), 1.0, 2.0)[0], [[1.0, 0.0], [2.0, 0.0]], atol=1e-9)


def test_the_script_writes_a_family_that_draws(tmp_path):
    file, output = str(log(tmp_path)), tmp_path / "room.yaml"
    command = [sys.executable, str(SCRIPTS / "building_family.py"), "--note", "Of a room.", "-o", str(output)]
    given = ["--building", file, "0", "2.5", "--building", file, "0.5", "3"]
    done = subprocess.run([*command, *given], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "# Of a room.\n" in output.read_text()
    drawn = [load_scenario(output, [f"seed={seed}", "draw.start_clearance=0.2"]).scenario for seed in (1, 2)]
    assert all(one.world.walls and 3 <= one.robots <= 5 for one in drawn)
    late = subprocess.run([*command, "--building", file, "5", "6"], capture_output=True, text=True, check=False)
    assert (late.returncode, late.stderr.count("\n")) == (2, 1) and "the robot drove 3.00 m" in late.stderr
