"""Late cameras show the past exactly; late commands act when they have come, in the order they were sent."""

import numpy as np
import pytest

from pbrg_mj.scenario.random_streams import Source, stream
from pbrg_mj.world.actuation.radio import RadioLink
from pbrg_mj.world.plant.physics import MujocoPlant
from tests.worlds import scenario

EVERY_STEP = {"timing": {"tick": 0.002, "physics_step": 0.002}}


def weave(step: int) -> np.ndarray:
    return 4.0 * np.array([[np.sin(0.01 * step), np.cos(0.013 * step)]])


@pytest.mark.parametrize(
    ("rate_hz", "delay", "steps"),
    [(500, 0.002, 1), (500, 0.05, 25), (1000, 0.0101, 6), (30, 0.1, 50), (30, 0.011, 6), (7, 0.5, 250), (60, 0.0, 0)],
)
def test_the_camera_shows_the_pose_of_exactly_its_delay_ago(rate_hz, delay, steps):
    world = MujocoPlant(scenario(sensors={"camera": {"rate_hz": rate_hz, "delay": delay}}, **EVERY_STEP))
    was = []
    for step in range(1000):
        seen = world.observe()
        was.append(world.truth().body_pose)
        then = max(step - steps, 0)
        frame = min(int(then * rate_hz * 0.002 + 1e-9), then)
        sampled = then if rate_hz >= 500 else int(np.ceil(frame / (rate_hz * 0.002) - 1e-9))
        assert seen.pose_frame == frame
        np.testing.assert_allclose(seen.body_pose, was[sampled], atol=1e-12)
        world.advance(weave(step))
    assert np.linalg.norm(was[-1] - was[0]) > 0.1


def test_until_the_first_late_frame_the_robots_know_where_they_start():
    headings = (30.0, -100.0)
    world = MujocoPlant(scenario(2, team={"heading_deg": headings}, sensors={"camera": {"delay": 0.2}}))
    start = world.truth().body_pose
    for _ in range(20):
        seen = world.observe()
        assert seen.pose_frame == 0
        np.testing.assert_allclose(seen.body_pose, start, atol=1e-12)
        world.advance(np.full((2, 2), 6.0))
    assert np.linalg.norm(world.truth().body_pose - start) > 0.05


def test_a_late_camera_changes_what_is_seen_and_nothing_else():
    states = []
    for camera in ({}, {"delay": 0.08}):
        world = MujocoPlant(scenario(beams="all", sensors={"camera": camera}))
        for step in range(50):
            world.advance(weave(5 * step))
        states.append((world.data.qpos.tobytes(), world.observe().ranges.tobytes()))
    assert states[0] == states[1]


def link(delay: float, jitter: float, robots: int = 1, seed: int = 1) -> RadioLink:
    return RadioLink(scenario(robots, radio={"delay": delay, "jitter": jitter}, seed=seed))


def arrivals(radio: RadioLink, apart: int, count: int) -> np.ndarray:
    """Return how many steps each of `count` commands, sent `apart` steps after one another, was on its way."""
    came = np.full(count, -1)
    for step in range(apart * count):
        if step % apart == 0:
            radio.send(np.full((1, 2), step // apart + 1.0), step)
        newest = int(radio.received(step)[0, 0])
        if newest and came[newest - 1] < 0:
            came[newest - 1] = step - apart * (newest - 1)
    return came


def test_a_constant_delay_holds_for_every_command():
    assert set(arrivals(link(0.05, 0.0), 30, 50)) == {25}
    assert set(arrivals(link(0.0501, 0.0), 30, 50)) == {26}  # up to a whole step
    assert set(arrivals(link(0.0, 0.0), 5, 50)) == {0}


def test_jitter_is_uniform_beyond_the_delay():
    came = arrivals(link(0.01, 0.04), 30, 4000)  # 5 steps, and 0 to 20 more, rounded up
    assert came.min() >= 5
    assert came.max() == 25
    counts = np.bincount(came - 6, minlength=20)
    expected = len(came) / 20
    assert ((counts - expected) ** 2 / expected).sum() < 43.8  # chi-square of 19 degrees of freedom, 0.1 %
    assert abs(np.corrcoef(came[:-1], came[1:])[0, 1]) < 3.5 / np.sqrt(len(came))


def test_commands_come_in_order_none_early_none_late():
    """Each comes when it and all before it have travelled."""
    radio, count = link(0.01, 0.1), 1000
    travel = [0.01 + 0.1 * stream(1, Source.RADIO, 0, k).random() for k in range(count)]
    alone = 5 * np.arange(count) + np.ceil(np.array(travel) / 0.002)
    came = np.maximum.accumulate(alone)
    assert (came > alone).sum() > 500
    for step in range(5 * count):
        if step % 5 == 0:
            radio.send(np.full((1, 2), step // 5 + 1.0), step)
        assert radio.received(step)[0, 0] == (came <= step).sum()


def test_jitter_is_each_robots_own_and_the_seeds():
    def times(radio: RadioLink) -> np.ndarray:
        radio.send(np.ones((2, 2)), 0)
        return np.array([radio.received(step)[:, 0] for step in range(60)]).argmax(axis=0)

    first, again, other = (times(link(0.0, 0.1, 2, seed)) for seed in (1, 1, 2))
    assert first[0] != first[1]
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_late_commands_make_the_same_run_later():
    """In 12 ms: six physics steps, more than a tick; until then the motors are shorted."""
    now = MujocoPlant(scenario(**EVERY_STEP))
    late = MujocoPlant(scenario(radio={"delay": 0.012}, **EVERY_STEP))
    for step in range(206):
        now.advance(np.zeros((1, 2)) if step < 6 else weave(step - 6))
        late.advance(weave(step))
    assert now.data.qpos.tobytes() == late.data.qpos.tobytes()
    assert now.truth().body_pose[0, 0] > -0.03
