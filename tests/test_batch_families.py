"""Batches of worlds that differ, or that cannot be stepped side by side; rates with intervals."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy import stats

import pbrg_mj as pbrg
from pbrg_mj.analysis.metrics.rates import Rate
from pbrg_mj.cli.main import main
from pbrg_mj.loop.batch import side_by_side
from pbrg_mj.loop.sequential import run_worlds
from pbrg_mj.scenario.load import load_scenario

SHORT = {"timing.duration": 0.3}
BOX = {
    "timing": {"duration": 1.2},
    "team": {"start": [[0.0, 0.0], [0.0, 1.0]], "formation": [[0.0, 0.0], [0.0, 1.0]], "leaders": [1]},
    "sensors": {"beams": {"robots": []}},
    "operator": {"reference": [0.0, 0.0]},
    "world": {
        "moving_boxes": [
            {
                "size": [0.2, 0.2],
                "waypoints": [{"time": 0, "center": [0.4, 0.0]}, {"time": 1, "center": [0.05, 0.0]}],
            }
        ]
    },
}


@pytest.mark.parametrize(("count", "trials"), [(0, 1), (1, 1), (0, 40), (3, 40), (40, 40), (156, 488), (5, 1000)])
@pytest.mark.parametrize("confidence", [0.8, 0.95, 0.99])
def test_intervals_are_wilsons(count, trials, confidence):
    ours = Rate.of(count, trials, confidence)
    theirs = stats.binomtest(count, trials).proportion_ci(confidence, method="wilson")
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high), abs=1e-12)
    assert ours.low <= ours.share <= ours.high


FEATURES = {
    "moving box": ("world.moving_boxes=[{size: [0.2, 0.2], waypoints: [{time: 0, center: [3, 0]}]}]",),
    "patch": ("world.patches=[{from: [-1, -1], to: [1, 1], friction: 0.5}]",),
    "speed loop": ("drive.kind=speed_loop",),
    "radio": ("radio.delay=0.02",),
}


@pytest.mark.parametrize("name", FEATURES)
def test_what_cannot_go_side_by_side_goes_one_by_one(name):
    plan = pbrg.load("paper/experiment_near", FEATURES[name], duration=0.1)
    assert not side_by_side(plan.settings)
    many = pbrg.batch(plan, (5, 3))
    for world, seed in enumerate((5, 3)):
        alone = pbrg.run(plan.override(seed=seed))
        np.testing.assert_array_equal(many.hand_world_m[world], alone.q_true_m)
        np.testing.assert_array_equal(many.moving_margin_m[world], alone.moving_margin_m)
    assert many.summary()["worlds"] == 2


def test_both_ways_are_the_same_to_the_bit():
    plan = pbrg.load("paper/experiment_near", duration=0.3)
    assert side_by_side(plan.settings)
    together = pbrg.batch(plan, (4, 9))
    for world, alone in enumerate(run_worlds([plan.override(seed=seed).settings for seed in (4, 9)])):
        for name in ("hand_world", "m", "wall_margin", "moving_margin"):
            theirs = together[{"hand_world": "hand_world_m", "m": "m_m"}.get(name, f"{name}_m")][world]
            assert getattr(alone, name)[0].tobytes() == theirs.tobytes()


def test_moving_boxes_count():
    many = pbrg.batch(pbrg.load(BOX), (1, 2))
    found = many.summary()
    assert (found["worlds_touching_moving"], found["worlds_past_a_moving_box"], found["worlds_touching"]) == (2, 2, 0)
    assert found["rates"]["touching_moving"]["share"] == 1.0 and many.failed
    assert found["true_margin_m"]["max"] < 0
    allowed = BOX | {"outcome": {"contacts": {"moving": "allowed"}}}
    assert not pbrg.batch(pbrg.load(allowed), (1,)).failed


def test_a_family_is_a_batch_of_its_worlds(tmp_path, capsys):
    out = tmp_path / "worlds.npz"
    command = ["batch", "families/combined", "--seeds", "3,5", "--duration", "0.3", "--threads", "1", "--json"]
    assert main([*command, "-o", str(out)]) == 0
    told, arrays = json.loads(capsys.readouterr().out), np.load(out)
    assert told["worlds"] == 2 and set(told["rates"]) >= {"violated", "touching_robots", "past_a_moving_box"}
    assert arrays["seeds"].tolist() == [3, 5]
    for world, seed in enumerate((3, 5)):
        drawn = pbrg.draw("families/combined", seed, SHORT)
        alone = pbrg.run(drawn)
        assert arrays["robots"][world] == drawn.settings.robots
        least = min(float(alone.wall_margin_m.min()), float(alone.moving_margin_m.min()))
        assert arrays["least_margin_m"][world] == least
        apart = alone.q_true_m[-1] - np.array(drawn.settings.team.formation) - drawn.settings.operator.reference
        assert arrays["final_distance_m"][world] == np.linalg.norm(apart, axis=1).max()


@pytest.mark.slow
def test_processes_change_nothing():
    drawn = [load_scenario("families/boards", [f"seed={seed}", "timing.duration=0.2"]).scenario for seed in (1, 2, 3)]
    for one, two in zip(run_worlds(drawn), run_worlds(drawn, 2), strict=True):
        assert one.hand_world.tobytes() == two.hand_world.tobytes() and one.seeds == two.seeds
