"""A team in the open, in physics: nothing is there but team-mates, so no half-space of points may be."""

from __future__ import annotations

import numpy as np
import pytest

import pbrg_mj as pbrg
from tests.scans import SENSORS


def places(random: np.random.Generator, count: int, reach: float, apart: float) -> list[list[float]]:
    """Return random places in a square, no two nearer than `apart` [m]."""
    found: list[np.ndarray] = []
    while len(found) < count:
        place = random.uniform(-reach, reach, 2).round(3)
        if all(np.linalg.norm(place - other) > apart for other in found):
            found.append(place)
    return [place.tolist() for place in found]


def team(seed: int) -> dict:
    """Return a scenario of three to six robots that drive past each other to a far place."""
    random = np.random.default_rng([seed, 77])
    count = int(random.integers(3, 7))
    start, formation = places(random, count, 0.7, 0.25), places(random, count, 0.5, 0.2)
    headings = random.uniform(-180.0, 180.0, count).round(1).tolist()
    return {
        "team": {"start": start, "formation": formation, "leaders": [1], "heading_deg": headings},
        "operator": {"reference": random.uniform(-2.0, 2.0, 2).round(2).tolist()},
        "world": {"walls": []},
        "timing": {"duration": 7.0},
        "seed": seed,
    }


def row(seed: int, speed: float) -> dict:
    """Return a scenario of five robots in a row, 0.23 to 0.34 m apart, that creep ahead, and two that watch them."""
    random = np.random.default_rng([seed, 79])
    along = np.array([np.cos(0.7 * seed), np.sin(0.7 * seed)])
    ahead, apart = np.array([-along[1], along[0]]), random.uniform(0.23, 0.34)
    places = [*((k - 2) * apart * along for k in range(5)), 0.1 * along - 0.6 * ahead, 0.9 * ahead - 0.2 * along]
    formation = [place.round(3).tolist() for place in places]
    headings = random.uniform(-180.0, 180.0, 7).round(1).tolist()
    way = [{"time": float(t), "reference": (speed * t * ahead).tolist()} for t in range(6)]
    return {
        "team": {"start": formation, "formation": formation, "leaders": [1], "heading_deg": headings},
        "operator": {"waypoints": way},
        "world": {"walls": []},
        "timing": {"duration": 6.0},
        "seed": seed,
    }


def any_half_space(given: dict, preset: str) -> bool:
    """Return whether any robot ever has a half-space, once its sensor's first scans are confirmed."""
    keys = {"set_up": "recommended", "reference.solver": "none", "sensors.beams.preset": preset}
    run = pbrg.run(pbrg.load(given, keys))
    return bool(run["half_space_active"][run.time_s > 0.45].any())


@pytest.mark.parametrize("preset", SENSORS)
@pytest.mark.parametrize("speed", [0.0, 0.01], ids=["rest", "creep"])
def test_rows_of_team_mates_give_no_half_space(preset: str, speed: float) -> None:
    assert not any_half_space(row(1, speed), preset)


@pytest.mark.parametrize("preset", ["ideal", "generic", "tof_ring", "tof_cones"])
@pytest.mark.parametrize("seed", [5, 6, 8])
def test_team_mates_in_the_open_give_no_half_space(preset: str, seed: int) -> None:
    """`lidar` and `lds_02`, which see 8 m, meet the floor there when robots tilt; outliers of `robotarium` may bind."""
    assert not any_half_space(team(seed), preset)
