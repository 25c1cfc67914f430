"""A log of version 0.1.0 opens, array by array as it was exported then, and its scenario still runs."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

import pbrg_mj as pbrg

LOG = Path(__file__).parent / "data" / "version_0_1_0.mcap"
EXPORTED = json.loads(LOG.with_suffix(".json").read_text())  # name: dtype, shape, digest of the export of then


@pytest.fixture(scope="module")
def run() -> pbrg.Run:
    return pbrg.open(LOG)


@pytest.mark.parametrize("name", EXPORTED)
def test_an_array_is_as_exported_then(run, name):
    array = np.asarray(run.arrays[name], order="C")
    assert [str(array.dtype), list(array.shape), hashlib.sha256(array.tobytes()).hexdigest()[:16]] == EXPORTED[name]


def test_the_log_is_whole(run):
    assert run.damage is None


def test_its_scenario_runs_with_todays_keys(run):
    """A key that was renamed since is in the scenario that the log embeds."""
    assert "carries:" in str(run.arrays["scenario_yaml"])
    again = pbrg.run(run.scenario)
    # Other versions of MuJoCo and other processors round differently; the first ticks hardly do.
    np.testing.assert_allclose(again.q_true_m[:5], run.q_true_m[:5], rtol=0, atol=1e-3)
