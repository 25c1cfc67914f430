"""The scenes and the evaluation behind the figures of docs/perception-accuracy.md."""

from pathlib import Path

import numpy as np
import pytest

SCRIPT = Path(__file__).parents[1] / "scripts" / "accuracy"


@pytest.fixture(autouse=True)
def _found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(SCRIPT)


def test_the_crowd_is_always_in_view_apart_and_moves_at_a_robots_speed() -> None:
    import robots

    for seed in range(5):
        poses = np.array(list(robots.crowd(np.random.default_rng(seed), 100, 0.1)))
        assert poses.shape == (100, 4, 3)
        walk, heading = poses[:, :, :2], poses[:-1, :, 2]
        step = np.diff(walk, axis=0)
        across = step[:, :, 1] * np.cos(heading) - step[:, :, 0] * np.sin(heading)
        assert np.mean(np.abs(across) < 1e-12) > 0.9  # all but those that take another way
        speed = np.linalg.norm(np.diff(walk, axis=0), axis=2) / 0.1
        assert speed.max() < 0.3 + 1e-9 and np.mean(speed > 0.049) > 0.9
        for places in walk:
            far = np.linalg.norm(places, axis=1)
            apart = np.linalg.norm(places[:, None] - places[None], axis=2) + np.eye(4)
            assert far.max() <= 1.8 and far.min() >= 0.16 and apart.min() >= 0.14 and places[:, 0].max() <= 1.92


def test_robots_behind_one_another_or_in_touch_are_not_in_view() -> None:
    import robots

    fine = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    assert robots.visible(fine)
    for place in ([0.5, 1.0], [1.95, 0.5], [0.1, 0.0], [-0.5, 0.02], [0.05, 1.1]):
        changed = fine.copy()
        changed[0] = place
        assert robots.visible(changed) == (place == [0.5, 1.0])


@pytest.mark.parametrize(("turn", "off", "wall"), [(0, 0, True), (2, 2, True), (8, 0, False), (0, 8, False)])
def test_a_track_is_the_walls_when_it_agrees_within_its_covariance(turn: int, off: int, wall: bool) -> None:
    import robots
    from scanning_robot import ScanningRobot, scenario

    scanner, std = ScanningRobot(scenario("generic")), np.array([0.01, 0.005])
    track = np.zeros(1, dtype=scanner.memory.tracks.dtype)[0]
    track["angle"], track["offset"] = np.array([turn, off]) * std + [0.0, robots.WALL]
    track["e_aa"], track["e_cc"] = std**2
    assert robots._is_wall(scanner, track) == wall


def test_the_page_holds_what_the_script_writes_and_its_head_is_kept() -> None:
    import page

    text = (SCRIPT.parents[1] / "docs" / "perception-accuracy.md").read_text(encoding="utf-8")
    head, begin, measured = text.partition(page.BEGIN)
    assert begin and head.endswith("## Measured\n\n") and measured.count("\n| ") > 70
    with pytest.raises(ValueError, match="no line"):
        page.written("# another page\n", {})


def test_the_judge_sees_a_planted_wall() -> None:
    import walls

    cell = walls.Cell("generic", 1.0, 30)
    rows = np.array([walls.place(cell, seed) for seed in range(12)])
    assert rows.shape == (12, walls.SCANS, 5)
    found = walls.figures(rows)
    assert found["recall"] == 1.0
    assert 0.5 < found["single_nees"] < 5 and found["single_offset_rms_m"] < 0.003
    assert found["fused_angle_rms_deg"] < found["single_angle_rms_deg"]
    assert walls.band(200) == pytest.approx((1.732, 2.287), abs=1e-3)


@pytest.mark.parametrize("sensor", ["robotarium", "lidar"])
def test_robots_seen_at_the_wheels_height_are_no_walls(sensor: str) -> None:
    """Seed 1 of the lidar has a robot and a stretch of the wall in one line on both sides of what own wheels hide."""
    import robots
    from scanning_robot import LOW

    assert [robots.false_walls(sensor, seed, LOW) for seed in (1, 2, 3)] == [0, 0, 0]
