"""Walls over time: fusion, its honesty, and what is no wall."""

import itertools

import numpy as np
import pytest
from scipy.stats import chi2

from pbrg_mj.perception.setup import perception_setup
from tests.perceiving import HAND, PENTAGON, box, rows, scenario, together, walk
from tests.raycast import Scene

WALL = Scene(((1.0, -3.0, 1.0, 3.0),))
ROOM = Scene(((-2, -1.5, 2, -1.5), (2, -1.5, 2, 1.5), (2, 1.5, -2, 1.5), (-2, 1.5, -2, -1.5)))
LOST = {"sensors": {"beams": {"dropout": 0.01}}}


def rests(*poses: tuple[float, float, float]):
    return lambda time: poses


def circling(time: float) -> list[tuple[float, float, float]]:
    return [(0.8 * np.cos(time / 3), 0.5 * np.sin(time / 3), time / 3)]


def errors(track: np.void, pose: np.ndarray, anchor: np.void) -> tuple[np.ndarray, np.ndarray]:
    """Error of (angle, offset) against the wall x = 1, about the anchor the track uses, and its covariance."""
    error = np.array([track["angle"], track["offset"] - (1.0 - anchor["x"])])
    return error, np.array([[track["e_aa"], track["e_ac"]], [track["e_ac"], track["e_cc"]]])


@pytest.mark.parametrize("scans", [1, 12])
def test_the_covariance_of_a_followed_wall_is_honest(scans: int) -> None:
    nees = []
    for seed in range(150):
        *_, (_, poses, _, memory) = walk(scenario(seed=seed), lambda t: WALL, rests((0, 0, 0.3)), scans)
        track = memory.tracks[0][0]
        error, covariance = errors(track, poses[0], memory.anchors[0])
        nees.append(error @ np.linalg.solve(covariance, error))
    low, high = chi2.ppf([0.005, 0.995], 2 * len(nees)) / len(nees)
    assert low < np.mean(nees) < high


def test_fusion_averages_the_noise_of_scans() -> None:
    steps = list(walk(scenario(), lambda t: WALL, rests((0, 0, 0.3)), 40))
    first, last = steps[0][3].tracks[0][0], steps[-1][3].tracks[0][0]
    assert last["p_aa"] == pytest.approx(first["p_aa"] / 40, rel=0.25)
    assert first["p_cc"] / 40 < last["p_cc"] < first["p_cc"] / 12  # the drift in sight holds it up
    assert np.sqrt(last["p_cc"]) < 0.0004
    assert last["hits"] == 40 and last["live"] and not steps[-1][3].tracks[0][1:]["live"].any()


def test_a_half_space_is_moved_by_the_deviation_of_a_wall_at_rest() -> None:
    given = scenario()
    for _, _, known, memory in walk(given, lambda t: WALL, rests((0, 0, 0.3)), 40):
        track, anchor = memory.tracks[0][0], memory.anchors[0]
        normal = np.array([np.cos(track["angle"]), np.sin(track["angle"])])
        s = 0.04 * np.sin(0.3 - track["angle"])  # of the hand point, by the true heading
        deviation = np.sqrt(track["e_cc"] - 2 * s * track["e_ac"] + s**2 * track["e_aa"])
        place = normal @ [anchor["x"], anchor["y"]] + track["offset"]
        assert place - known.h[0, 0] - 0.1 == pytest.approx(3 * deviation, rel=0.01)
    assert track["e_cc"] < 0.9 * track["p_cc"]


def test_scans_that_share_a_camera_frame_do_not_average_its_noise() -> None:
    slow = scenario(sensors={"camera": {"rate_hz": 2.0}})
    shared, fresh = (perception_setup(s, 0.1).parameters.pose for s in (slow, scenario()))
    assert shared.position_var == pytest.approx(5 * fresh.position_var)  # ten scans share two frames
    assert fresh.position_var == pytest.approx(0.001**2)


def test_fewer_than_three_in_a_thousand_walls_lie_outside_three_sigma() -> None:
    outside, total = 0, 0
    for seed in range(60):
        given = scenario(PENTAGON, seed=seed, **LOST)
        poses = rests(*((b[0], b[1], 1.3 * seed + k) for k, b in enumerate(PENTAGON)))
        for time, true, known, _ in walk(given, lambda t: WALL, poses, 8):
            hand = true[:, :2] + HAND * np.column_stack([np.cos(true[:, 2]), np.sin(true[:, 2])])
            for robot in range(5):
                (G, h), b = rows(known, robot), np.array(PENTAGON)
                team = hand[robot] + b - b[robot]
                assert len(G) == 1 or time < 0.15  # lost beams may cut the first sighting in two
                outside += np.any((h - team @ G.T).min(axis=1) > 0.9 - team[:, 0])
                total += 1
    assert total == 2400 and outside / total <= 0.003


def test_a_long_wall_counts_when_seen_twice_and_a_short_one_when_it_cannot_be_moving() -> None:
    def seen(scene: Scene, scans: int = 40) -> float:
        run = walk(scenario(**LOST), lambda t: scene, rests((0, 0, 0)), scans)
        return next((t for t, _, known, _ in run if known.active.any()), np.inf)

    assert seen(WALL) == 0.0  # at the start there is nothing to wait for
    assert seen(Scene(((1.0, -0.6, 1.0, 0.6),))) == pytest.approx(0.1)
    assert 0.5 < seen(box(0.8, 0.0, 0.6)) < 2.5
    assert seen(box(0.9, 0.0, 0.6, angle=np.pi / 4)) <= 0.7  # two faces at a corner leave it no way to move


@pytest.mark.parametrize("speed", [0.1, 0.2, 0.5])
@pytest.mark.parametrize("direction", [0.0, 0.6, np.pi / 2])
def test_a_moving_box_is_no_wall(speed: float, direction: float) -> None:
    way = speed * np.array([np.cos(direction), np.sin(direction)])
    for seed in range(3):
        start = np.array([0.45 + 0.05 * seed, -0.4 * np.sin(direction)])

        def moving(time: float, start: np.ndarray = start) -> Scene:
            return box(*(start + way * time), 0.3, angle=0.2 * seed)  # noqa: B023

        run = walk(scenario(seed=seed, **LOST), moving, rests((0, 0, 0)), 40)
        assert not any(known.active.any() for _, _, known, _ in run)


def test_other_robots_and_lone_outliers_are_no_walls() -> None:
    noisy = {"sensors": {"beams": {"dropout": 0.02, "outliers": 0.02}}}
    random = np.random.default_rng(4)
    for seed in range(6):
        starts, ways = random.uniform(-1.2, 1.2, (4, 2)), random.uniform(-0.2, 0.2, (4, 2))

        def team(time: float, starts: np.ndarray = starts, ways: np.ndarray = ways) -> Scene:
            places = starts + time * ways
            return Scene((), tuple((x, y, 0.06) for x, y in places.tolist() if np.hypot(x, y) > 0.2))

        run = walk(scenario(seed=seed, **noisy), team, rests((0, 0, 0)), 60)
        assert not any(known.active.any() for _, _, known, _ in run)


def test_slots_and_normals_stay_over_three_hundred_noisy_scans() -> None:
    crowd = together(ROOM, Scene((), ((0.9, 0.3, 0.06),)))
    first, worst, jump, last = None, 0.0, 0.0, None
    for time, poses, known, _ in walk(scenario(**LOST), lambda t: crowd, circling, 300):
        assert known.active.all()
        first = known.G[0] if first is None else first
        worst = max(worst, np.abs(known.G[0] - first).max())
        truth = np.where(np.abs(known.G[0, :, 0]) > 0.5, 1.9, 1.4)
        gap = truth - known.h[0] + (known.G[0] - np.round(known.G[0])) @ poses[0, :2]
        if time > 1:
            jump = max(jump, np.abs(known.h[0] - last).max())
            assert gap.min() > -0.001 and gap.max() < 0.03
        last = known.h[0]
    assert worst < np.sin(np.deg2rad(1.0)) and jump < 0.02


def test_a_wall_out_of_sight_grows_uncertain_and_is_forgotten() -> None:
    given = scenario(estimator={"memory": 1.0})
    seen = walk(given, lambda t: WALL if t < 0.95 else Scene(), rests((0, 0, 0)), 21)
    slack = [float(rows(known)[1][0]) if known.active.any() else None for *_, known, _ in seen]
    assert all(h is not None for h in slack[:20]) and slack[20] is None
    unseen = np.array(slack[10:20], dtype=float)
    assert np.all(np.diff(unseen) < 0)
    assert unseen[0] - unseen[-1] > 2 * (0.005 * np.sqrt(0.9) - 0.002)


def test_a_wall_seen_again_is_the_same_wall() -> None:
    steps = list(walk(scenario(), lambda t: Scene() if 1 < t < 3 else WALL, rests((0, 0, 0)), 45))
    track = steps[-1][3].tracks[0]
    assert track["live"].sum() == 1 and track[0]["hits"] > 20
    assert all(known.active[0].tolist() == [True, False, False, False] for *_, known, _ in steps)


def test_a_wall_that_beams_go_through_is_dropped_long_before_the_memory_ends() -> None:
    behind = Scene(((3.0, -3.0, 3.0, 3.0),))
    steps = list(walk(scenario(), lambda t: together(WALL, behind) if t < 1 else behind, rests((0, 0, 0)), 20))
    nearest = [rows(known)[1].min() for *_, known, _ in steps]
    assert nearest[9] < 1 and nearest[11] < 1 and min(nearest[14:]) > 2.5


def test_a_wall_behind_another_thing_is_kept() -> None:
    hidden = together(WALL, box(0.5, 0.0, 0.4, 3.0))
    steps = list(walk(scenario(), lambda t: WALL if t < 1 else hidden, rests((0, 0, 0)), 40))
    track = steps[-1][3].tracks[0]
    assert np.sum(track["live"] * (np.abs(track["offset"] - 1) < 0.02) * (np.abs(track["angle"]) < 0.1)) == 1


def test_what_is_more_often_missed_than_seen_is_no_wall() -> None:
    """A line in the first scan, then teeth of 14 cm, of which no scan makes a line: four scans later it is gone."""
    corners = [(1.0 + 0.07 * (-1) ** k, 0.2 * k) for k in range(-16, 17)]
    teeth = Scene(tuple((*a, *b) for a, b in itertools.pairwise(corners)))
    live = []
    for _, _, _, memory in walk(scenario(), lambda t: WALL if t < 0.05 else teeth, rests((0, 0, 0.3)), 8):
        tracks = memory.tracks[0][memory.tracks[0]["live"] == 1]
        assert not (tracks["hits"] > 1).any()
        live.append(bool((tracks["first"] == 0.0).any()))
    assert live == [True] * 4 + [False] * 4
