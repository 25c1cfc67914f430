"""Poses of a filter: their errors last from scan to scan, and count as independent ones of more variance."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.perception.perceive import initial, perceive
from pbrg_mj.perception.track.filtered_poses import equivalent_variances
from pbrg_mj.perception.track.world_frame import PoseModel
from pbrg_mj.sensing.noise import sensor_noise
from pbrg_mj.sensing.pose_filter import Estimate, FilterMemory
from tests.perceiving import readings, scenario, setup
from tests.raycast import Scene

R = np.array([4e-6, 9e-5])  # of a frame, [m^2] and [rad^2]
SCANS = 600


def model(frames_a_scan: float) -> PoseModel:
    shared = max(1.0, 1.0 / frames_a_scan)
    return PoseModel(shared * R[0], shared * R[1], 0.1 / frames_a_scan, 0.1, 0.0, 0.01, shared, 0)


def covariance(variances: np.ndarray) -> np.ndarray:
    return np.diag([variances[0], variances[0], variances[1]])[None]


@pytest.mark.parametrize("frames_a_scan", [0.2, 1.0, 3.0])
@pytest.mark.parametrize("gain", [0.1, 0.4, 0.9])
def test_the_mean_of_a_filters_errors_is_as_wrong_as_its_equivalent_variance_says(frames_a_scan: float, gain: float):
    """A filter of constant gain K runs beside it, e' = (1 - K) (e + w) + K v, in 4000 runs of 600 scans."""
    random, frames = np.random.default_rng(5), round(SCANS * frames_a_scan)
    slip = gain**2 / (1.0 - gain)  # of R: K is the gain at which the variance K R does not change
    e, means = np.sqrt(gain) * random.standard_normal(4000), np.zeros(4000)
    every = max(round(frames_a_scan), 1)  # frames from scan to scan; one for several scans counts for all of them
    for frame in range(frames):
        drift = np.sqrt(slip) * random.standard_normal(4000)
        e = (1.0 - gain) * (e + drift) + gain * random.standard_normal(4000)
        if frame % every == 0:
            means += e * every / frames
    found = equivalent_variances(covariance(gain * R), covariance(gain * R), model(frames_a_scan))
    assert found[0] / R == pytest.approx(SCANS * np.mean(means**2), rel=0.12)


def test_slip_since_the_last_frame_counts_too_and_exact_poses_stay_exact():
    now = equivalent_variances(covariance(0.5 * R), covariance(2.0 * R), model(1.0))
    assert now[0] == pytest.approx(2.0 * R * 1.5 / 0.5)
    exact = PoseModel(0.0, 0.0, 0.1, 0.1, 0.0, 0.01, 1.0, 0)
    assert not equivalent_variances(np.zeros((1, 3, 3)), np.zeros((1, 3, 3)), exact).any()


def test_a_line_seen_from_a_filters_pose_has_that_variance():
    given = scenario(seed=4)
    known, wall = setup(given), Scene(((1.0, -3.0, 1.0, 3.0),))
    plain = readings([wall], np.zeros((1, 3)), sensor_noise(given), 0)
    estimate = Estimate(plain.body_pose, covariance(0.5 * R))
    nothing = np.zeros((1, 2)), np.zeros((1, 3)), np.zeros(1)
    filtered = plain._replace(pose_filter=FilterMemory(estimate, estimate, (), *nothing))
    (_, before), (_, after) = (perceive(one, 0.0, initial(known), known) for one in (plain, filtered))
    equivalent = equivalent_variances(estimate.covariance, estimate.covariance, known.parameters.pose)[0]
    added = equivalent - [known.parameters.pose.position_var, known.parameters.pose.heading_var]
    assert after.tracks[0, 0]["p_aa"] - before.tracks[0, 0]["p_aa"] == pytest.approx(added[1])
    assert after.tracks[0, 0]["p_cc"] - before.tracks[0, 0]["p_cc"] == pytest.approx(added[0])
