"""What is summed up a block at a time is what the whole gives."""

from __future__ import annotations

import gc

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.analysis.metrics import samples as module
from pbrg_mj.analysis.metrics.index_join import IndexJoin, MissingRowError
from pbrg_mj.analysis.metrics.run_metrics import metrics
from pbrg_mj.analysis.metrics.samples import Samples
from pbrg_mj.analysis.metrics.settling import Settling
from pbrg_mj.api.simulate import measure
from pbrg_mj.log.read.run import TickSeries
from tests.runs import run, scenario

SPECIAL = [0.0, -0.0, 5e-324, -5e-324, 1e30, -1e30, 1.0, -1.0]


@np.errstate(invalid="ignore")  # between infinities
@pytest.mark.parametrize("held", [4, 1000])
@pytest.mark.parametrize("seed", range(6))
def test_percentiles_are_exact_however_few_numbers_are_held(seed, held, monkeypatch):
    monkeypatch.setattr(module, "MOST_HELD", held)
    rng = np.random.default_rng((21, seed))
    values = np.append(rng.standard_normal(rng.integers(1, 300)) * 10.0 ** rng.integers(-9, 9), SPECIAL)
    values = rng.permutation(np.append(values, rng.choice(values, 20)))  # ties
    if seed == 5:
        values[:40] = np.inf  # and so is the 95th percentile
    many = Samples()
    for block in np.array_split(values, 7):
        many.add(block)
    for percent in (0, 50, 95, 100):
        np.testing.assert_equal(many.percentile(percent), np.percentile(values, percent))
    assert many.statistics().mean == pytest.approx(values.mean(), rel=1e-12, abs=1e15)
    assert many.statistics().final == values[-1]
    many.add(np.array([np.nan]))
    assert np.isnan(many.percentile(50))


def test_rows_find_their_partners_whatever_comes_first():
    rng, index = np.random.default_rng(22), np.arange(0, 200, 5)
    partners = np.sort(rng.choice(index, 17, replace=False))
    found: list[int] = []

    def take(pairs):
        for first, second in pairs:
            np.testing.assert_array_equal(first["index"], second["index"])
            np.testing.assert_array_equal(first["value"], 2 * second["index"])
            found.extend(first["index"].tolist())

    joined = IndexJoin(complete=True)
    firsts, seconds = np.array_split(index, 9), np.array_split(partners, 5)
    while firsts or seconds:
        if firsts and (not seconds or rng.random() < 0.5):
            block = firsts.pop(0)
            take(joined.first({"index": block, "value": 2 * block}, int(block[-1])))
        else:
            take(joined.second({"index": seconds.pop(0)}))
    assert found == partners.tolist()
    with pytest.raises(MissingRowError):
        take(joined.second({"index": np.array([7])}))


def test_a_run_measured_leaves_nothing_that_waits_for_the_collector(tmp_path):
    """A study makes thousands of runs in one process, and Python looks for garbage in cycles rarely."""
    small = pbrg.load("paper/simulation_near", duration=0.3)
    measure(small)
    pbrg.run(small, log=tmp_path / "first.mcap")
    gc.collect()
    gc.set_debug(gc.DEBUG_SAVEALL)
    try:
        measure(small)
        pbrg.run(small, log=tmp_path / "second.mcap")
        gc.collect()
        found = {f"{type(one).__module__}.{type(one).__qualname__}" for one in gc.garbage}
    finally:
        gc.set_debug(0)
        gc.garbage.clear()
    assert not {name for name in found if name.startswith(("pbrg_mj.", "numpy.", "mujoco."))}


@pytest.mark.parametrize("seed", range(12))
def test_settling_in_blocks_is_that_of_the_whole(seed):
    """The reference changes at random ticks, the team is here and there within tolerance."""
    rng, plan, steps = np.random.default_rng((23, seed)), scenario(), 21
    r = np.array([[1.0, 0.0], [0.5, 0.2]])[(np.cumsum(rng.random(steps) < 0.15) % 2)]
    away = np.where(np.arange(steps) < rng.integers(0, steps + 1), rng.choice([0.0, 0.3], steps), 0.0)
    hand = (r + away[:, None])[:, None, :] + np.array(plan.team.formation)
    ticks = vars(run(ticks={"hand_true": hand, "reference": r}).ticks)
    whole, parts = Settling(plan), Settling(plan)
    whole.add(TickSeries.of(ticks))
    for rows in np.array_split(np.arange(steps), rng.integers(2, 21)):
        parts.add(TickSeries.of({name: values[rows] for name, values in ticks.items()}))
    late = np.flatnonzero(away > plan.outcome.tolerance)
    changed = np.append(0, np.flatnonzero(np.diff(r, axis=0).any(axis=1)) + 1)[-1]
    settled = late[-1] + 1 if len(late) else 0
    expected = np.nan if settled >= steps else max(0.0, 0.5 * (settled - changed))
    for one in (whole, parts):
        np.testing.assert_equal(one.time(), expected)


def test_metrics_of_a_run_in_memory_hold_no_numpy_numbers():
    allowed = {bool, int, float, str, dict, tuple, type(None)}
    assert {type(value) for value in metrics(run()).as_dict().values()} <= allowed
