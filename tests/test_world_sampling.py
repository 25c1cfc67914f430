import mujoco
import numpy as np
import pytest

from pbrg_mj.world.physics_steps import steps_during, steps_until
from pbrg_mj.world.sensors.sampling import Sampler

RATES = [(10, 0.002), (30, 0.002), (7, 0.002), (29.97, 0.002), (10, 0.001), (3, 0.005), (100, 0.002), (333, 0.002)]


def sampled_clock(sampler: Sampler) -> mujoco.MjModel:
    interval = "" if sampler.every_step else f'nsample="1" interval="{sampler.interval!r}"'
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{sampler.physics_step!r}"/><sensor><clock {interval}/></sensor></mujoco>'
    )


@pytest.mark.parametrize(("rate_hz", "physics_step"), [*RATES, (500, 0.002), (600, 0.002)])
def test_frames_count_exactly_the_samples_that_mujoco_takes(rate_hz, physics_step):
    sampler = Sampler(rate_hz, physics_step)
    model = sampled_clock(sampler)
    data = mujoco.MjData(model)
    frame, last = -1, -1.0
    for step in range(30000):
        mujoco.mj_step1(model, data)
        if data.sensordata[0] != last:
            frame, last = frame + 1, data.sensordata[0]
        assert sampler.frame(step) == frame, step
        mujoco.mj_step2(model, data)


@pytest.mark.parametrize(("rate_hz", "physics_step"), RATES)
def test_samples_are_never_early_nor_a_whole_step_late(rate_hz, physics_step):
    sampler = Sampler(rate_hz, physics_step)
    frames = np.array([sampler.frame(step) for step in range(5000)])
    first = np.flatnonzero(np.diff(frames, prepend=-1))
    late = first * physics_step - frames[first] / rate_hz
    assert late.min() > -1e-9
    assert late.max() < physics_step


@pytest.mark.parametrize(("rate_hz", "physics_step"), RATES)
def test_a_sample_is_taken_at_the_first_step_that_counts_it(rate_hz, physics_step):
    sampler = Sampler(rate_hz, physics_step)
    frames = [sampler.newest(step) for step in range(3000)]
    for frame in range(frames[-1] + 1):
        assert frames.index(frame) == sampler.step(frame)


@pytest.mark.parametrize(("rate_hz", "physics_step"), [*RATES, (500, 0.002), (600, 0.002)])
@pytest.mark.parametrize("steps", [1, 50, 333])
def test_mujoco_holds_each_sample_from_exactly_its_delay_on(rate_hz, physics_step, steps):
    sampler = Sampler(rate_hz, physics_step, round(steps * physics_step, 6))
    interval = "" if sampler.every_step else f'interval="{sampler.interval!r}"'
    late = f'nsample="{sampler.history}" delay="{sampler.native_delay!r}"'
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{physics_step!r}"/><sensor><clock {late} {interval}/></sensor></mujoco>'
    )
    data = mujoco.MjData(model)
    mujoco.mj_initSensorHistory(model, data, 0, None, np.zeros((sampler.history, 1)), -sampler.interval)
    for step in range(3000):
        mujoco.mj_step1(model, data)
        taken = sampler.step(sampler.frame(step)) * physics_step
        assert data.sensordata[0] == pytest.approx(taken, abs=1e-9), step
        mujoco.mj_step2(model, data)


@pytest.mark.parametrize(("rate_hz", "physics_step"), [*RATES, (500, 0.002), (600, 0.002)])
@pytest.mark.parametrize("steps", [0, 1, 50])
def test_a_frame_is_held_until_the_step_that_is_foretold(rate_hz, physics_step, steps):
    sampler = Sampler(rate_hz, physics_step, round(steps * physics_step, 6))
    frames = np.array([sampler.frame(step) for step in range(1500)])
    ends = np.flatnonzero(np.diff(frames)) + 1
    assert [sampler.held_until(frame) for frame in frames[ends - 1].tolist()] == ends.tolist()


def test_seconds_become_whole_steps_by_their_decimals():
    assert [steps_until(time, 0.002) for time in (0, 0.002, 0.0021, 0.3, 20.0)] == [0, 1, 2, 150, 10000]
    assert steps_during(0.1, 0.2, 0.002) == range(50, 150)  # though 0.1 + 0.2 > 0.3 in binary
    assert steps_during(0.0005, 0.002, 0.002) == range(1, 2)
    assert 10**12 in steps_during(1.0, None, 0.002)
