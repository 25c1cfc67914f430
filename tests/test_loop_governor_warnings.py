"""Keys of another governor than the scenario's are named before a run, and do nothing; in their own kind none is."""

from __future__ import annotations

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.cli.main import main
from pbrg_mj.loop.governor_warnings import governor_warnings
from pbrg_mj.studies.bench.suite import bundled_suites, read_suite

KEYS = {
    "optimizer": ("optimizer", "scalar", "kind: certified"),
    "speed_rows": ("speed_rows", False, "kind: certified"),
    "sight_rows": ("sight_rows", False, "kind: certified"),
    "rollout_order": ("rollout_order", 3, "kind: rollout"),
    "barrier_gain": ("barrier_gain", 2.0, "kind: cbf"),
    "field_gain": ("field_gain", 0.01, "kind: potential_field"),
    "field_range": ("field_range", 0.3, "kind: potential_field"),
    "nids.step": ("nids", 0.1, "optimizer: nids"),
    "admm.penalty": ("admm", 2.0, "optimizer: admm"),
    "flow_in_m.gain": ("flow_in_m", 3.0, "optimizer: flow_in_m"),
}
KINDS = ("distributed", "certified", "rollout", "centralized", "none", "cbf", "potential_field")


def said(key):
    """Return the key's own kind, or optimizer of the certified one, as keys; and the warning elsewhere."""
    name, _, whose = KEYS[key]
    kind, value = whose.split(": ")
    own = {"governor.kind": value} if kind == "kind" else {"governor.kind": "certified", "governor.optimizer": value}
    return own, f"governor.{name} has no effect: it belongs to `governor.{whose}`"


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("key", KEYS)
def test_a_key_warns_with_every_kind_but_its_own(key, kind):
    own, warning = said(key)
    scenario = pbrg.load("paper/experiment_near", {"governor.kind": kind, f"governor.{key}": KEYS[key][1]})
    assert [one for one in scenario.warnings() if one == warning] == [warning] * (own != {"governor.kind": kind})
    scenario = pbrg.load("paper/experiment_near", own | {f"governor.{key}": KEYS[key][1]})
    assert governor_warnings(scenario.settings) == []


@pytest.mark.parametrize("kind", KINDS)
def test_what_has_no_effect_leaves_every_bit(kind):
    """All keys that are warned of at once, beside the kind alone."""
    base = {"governor.kind": kind, "reference.solver": "none"}
    foreign = {
        f"governor.{key}": value for key, (_, value, _) in KEYS.items() if said(key)[0] != {"governor.kind": kind}
    }
    runs = [pbrg.run(pbrg.load("obstacles/corner", keys, duration=1.0)) for keys in (base, base | foreign)]
    for name in ("q_true_m", "m_m"):
        np.testing.assert_array_equal(getattr(runs[0], name), getattr(runs[1], name))


def test_run_and_validate_tell_it_once(tmp_path, capsys, caplog):
    scenario = pbrg.load("paper/simulation_near", {"governor.rollout_order": 3}, duration=0.1)
    (tmp_path / "given.yaml").write_text(scenario.yaml)
    warning = said("rollout_order")[1]
    assert main(["validate", str(tmp_path / "given.yaml")]) == 0
    assert capsys.readouterr().err == f"warning: {tmp_path / 'given.yaml'}: {warning}\n"
    pbrg.run(scenario)
    assert [record.getMessage() for record in caplog.records] == [f"paper/simulation_near: {warning}"]


def test_points_without_a_separation_are_warned_of():
    """`auto` is a distance with the certified governor alone; who gives a distance, or null, has chosen."""

    def warned(**keys):
        named = {key.replace("__", "."): value for key, value in keys.items()}
        settings = pbrg.load("obstacles/box", {"set_up": "recommended"} | named).settings
        return [one for one in governor_warnings(settings) if one.startswith("control.separation")]

    assert len(warned(governor__kind="rollout")) == len(warned(governor__kind="cbf")) == 1
    assert warned() == warned(governor__kind="rollout", control__separation=0.22) == []
    assert warned(governor__kind="rollout", control__separation=None) == []
    assert warned(governor__kind="rollout", estimator__source="beams") == []


def test_nothing_bundled_has_keys_without_effect():
    """Scenarios and families as they are and recommended, and the suites' governors in their worlds."""
    for one in pbrg.list_scenarios():
        for keys in ({}, {"set_up": "recommended"}):
            assert governor_warnings(pbrg.load(one.name, keys).settings) == [], one.name
    for name in bundled_suites():
        tasks = {task.labels["governor_name"]: task for task in read_suite(name).tasks}
        for governor, task in tasks.items():
            assert governor_warnings(task.scenario().settings) == [], governor
