"""The truth, told later from what was kept of each tick, is what it would have been then."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.world.plant.build import build_plant

BOX = "[{size: [0.2, 0.3], waypoints: [{time: 0, center: [3, 0]}, {time: 1, center: [2.6, 0]}]}]"


@pytest.mark.parametrize(
    ("name", "overrides"), [("paper/experiment_near", ["world.moving_boxes=" + BOX]), ("paper/simulation_near", [])]
)
def test_truths_of_samples_are_the_truth_of_each_tick(name: str, overrides: list[str]) -> None:
    world = build_plant(load_scenario(name, overrides).scenario)
    command, samples, want = np.full((5, 2), 0.3), [], []
    for tick in range(12):
        samples.append(world.sample_truth())
        want.append(world.truth())
        world.advance(command * (1 + tick))
    found = world.truths(samples)
    assert len({one.wall_margin.tobytes() for one in found}) == len(found)
    for one, then in zip(found, want, strict=True):
        for name, value in one._asdict().items():
            np.testing.assert_array_equal(value, getattr(then, name), err_msg=name)
            assert value.dtype == getattr(then, name).dtype
