"""A team in the open, in physics: nothing is there but team-mates, so no half-space of points may be."""

from __future__ import annotations

import numpy as np
import pytest

import pbrg_mj as pbrg


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


@pytest.mark.parametrize("preset", ["ideal", "generic", "tof_ring", "tof_cones"])
@pytest.mark.parametrize("seed", [5, 6, 8])
def test_team_mates_in_the_open_give_no_half_space(preset: str, seed: int) -> None:
    """`lidar` and `lds_02`, which see 8 m, meet the floor there when robots tilt; outliers of `robotarium` may bind."""
    keys = {"set_up": "recommended", "reference.solver": "none", "sensors.beams.preset": preset}
    run = pbrg.run(pbrg.load(team(seed), keys))
    assert not run["half_space_active"][run.time_s > 0.45].any()
