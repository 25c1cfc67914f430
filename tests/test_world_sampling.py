import mujoco
import numpy as np
import pytest

from pbrg_mj.world.sampling import Sampler

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
