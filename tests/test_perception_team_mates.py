"""Lines that team-mates alone may make: rows of robots whose places are told are no walls, what is behind them is."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.perceive import initial, perceive
from pbrg_mj.perception.scan.extract_lines import line_buffer
from pbrg_mj.perception.scan.team_mates import _move_line
from pbrg_mj.perception.setup import perception_setup
from pbrg_mj.scenario.random_streams import Source, stream
from pbrg_mj.sensing.beam_model import noisy_scan
from pbrg_mj.sensing.noise import sensor_noise
from pbrg_mj.sensing.readings import Readings
from tests.perceiving import CLEARANCE, HAND, rows, scenario
from tests.raycast import PLATE, Scene, cast

SEEDS = {"robotarium": 24, "generic": 24, "lidar": 12}
WALL = Scene(((2.2, -4.0, 2.2, 4.0),))


def last(
    preset: str, seed: int, radius: float, speed: float = 0.0, behind: Scene | None = None
) -> tuple[bool, HalfSpaces]:
    """Whether a half-space ever bound in 50 scans of a row of four team-mates, and the last half-spaces."""
    random = np.random.default_rng([seed, 11])
    middle, turn = np.array([random.uniform(0.4, 1.6), random.uniform(-0.3, 0.3)]), random.uniform(-0.5, 0.5)
    step = random.uniform(0.13, 0.3) * np.array([-np.sin(turn), np.cos(turn)])
    formation = tuple((0.0, float(k)) for k in range(5))
    given = scenario(formation, sensors={"beams": {"preset": preset, "robots": [1]}}, seed=seed)
    setup, noise, beams = perception_setup(given, CLEARANCE, HAND, radius), sensor_noise(given), given.sensors.beams
    memory, known, bound = initial(setup), HalfSpaces.empty(5, 1), False
    poses = np.zeros((5, 3))
    poses[0, 2], std = random.uniform(-np.pi, np.pi), [noise.position_std, noise.position_std, noise.heading_std]
    for k in range(50):
        time = k / beams.rate_hz
        poses[1:, :2] = middle - [speed * time, 0.0] + (np.arange(4) - 1.5)[:, None] * step
        scene = Scene((), tuple((x, y, PLATE) for x, y, _ in poses[1:].tolist())) + (behind or Scene())
        raw = np.nan_to_num(cast(scene, poses[0], beams.count, beams.range_max), nan=-1.0)
        ranges = noisy_scan(raw, noise, stream(seed, Source.BEAMS, 0, k))
        seen = poses + stream(seed, Source.CAMERA, 0, k).standard_normal((5, 3)) * std
        known, memory = perceive(Readings(seen, ranges[None], True, 3 * k, k), time, memory, setup)
        bound |= bool(known.active[0].any())
    return bound, known


@pytest.mark.parametrize("preset", SEEDS)
@pytest.mark.parametrize("speed", [0.0, 0.01], ids=["rest", "creep"])
def test_rows_of_team_mates_are_no_walls(preset: str, speed: float) -> None:
    seeds = range(100, 100 + SEEDS[preset])
    assert not any(last(preset, seed, PLATE, speed)[0] for seed in seeds)


def test_without_their_places_some_rows_pass_for_walls() -> None:
    assert any(last("robotarium", seed, 0.0)[0] for seed in range(100, 124))


def test_a_wall_behind_a_row_is_as_it_would_be_without_places() -> None:
    for seed in range(3):
        (_, told), (_, untold) = last("generic", seed, PLATE, behind=WALL), last("generic", seed, 0.0, behind=WALL)
        G, h = rows(told)
        assert len(G) > 0
        assert np.any((G[:, 0] > 0.99) & (np.abs(h - (WALL.segments[0][0] - CLEARANCE)) < 0.03))
        assert {tuple(row) for row in G.tolist()} <= {tuple(row) for row in rows(untold)[0].tolist()}


def test_a_line_moves_up_with_all_that_is_known_of_it() -> None:
    lines, random = line_buffer(30), np.random.default_rng(1)
    for column in lines:
        column[:] = random.normal(size=column.shape)
        column[1] = ~column[0] if column.dtype == bool else column[1]
    _move_line(lines, 1, 0)
    for column in lines:
        np.testing.assert_array_equal(column[0], column[1])
