"""What no machine can run is refused in one line, before it runs and at little cost."""

from __future__ import annotations

import itertools
from typing import Any, get_args, get_origin

import numpy as np
import pytest
from annotated_types import Ge, Gt, Le, Lt

import pbrg_mj as pbrg
from pbrg_mj.errors import InputError
from pbrg_mj.governor.stability.linear_step import max_robots_on_hull_edge
from pbrg_mj.loop import resources
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.checks.check import MOST_FINDINGS, check
from pbrg_mj.scenario.load import parse_scenario
from pbrg_mj.scenario.parse import validation
from pbrg_mj.scenario.schema import Scenario, Section
from pbrg_mj.scenario.schema.describe import _bare, keys
from tests.scenario_texts import THREE, three


def complaint(*overrides, name="paper/experiment_near"):
    with pytest.raises(InputError) as caught:
        pbrg.load(name, overrides)
    assert len(str(caught.value).splitlines()) == 1
    assert len(str(caught.value)) < 400
    return str(caught.value)


def numbers(kind: Any, metadata: tuple, path: str):
    """Yield every number that the schema has below a type, with its bounds."""
    kind, metadata = _bare(kind, metadata)
    if kind in (int, float):
        yield path, metadata
    elif isinstance(kind, type) and issubclass(kind, Section):
        for name, field in keys(kind).items():
            yield from numbers(field.annotation, tuple(field.metadata), f"{path}.{name}")
    elif get_origin(kind) is not dict:
        for k, inner in enumerate(get_args(kind)):
            if not isinstance(inner, str) and inner is not ...:
                yield from numbers(inner, metadata, f"{path}/{k}")


def test_every_number_of_a_scenario_is_bounded_on_both_sides():
    found = list(numbers(Scenario, (), "scenario"))
    assert len(found) > 80
    loose = [
        path
        for path, bounds in found
        if not (any(isinstance(b, Ge | Gt) for b in bounds) and any(isinstance(b, Le | Lt) for b in bounds))
    ]
    assert [path for path in loose if not path.endswith(ROBOTS)] == []


# Robot numbers are compared with how many robots there are; delays have bounds that depend on the exchange.
ROBOTS = (
    "robot",
    *(f"{name}/{k}" for name in ("robots", "leaders", "edges") for k in (0, 1)),
    *(
        "robots/1/0",
        "edges/0/0",
        "edges/0/1",
        "delay_rounds",
        "jitter_rounds",
        "delay_ticks",
        "jitter_ticks",
        "reserve_rounds/0",
    ),
)


@pytest.mark.parametrize(
    ("override", "says"),
    [
        (
            "governor.rounds=1000000000000",
            "governor.rounds: is 1000000000000; allowed: a whole number from 1 to 10000;",
        ),
        ("governor.rounds=1" + "0" * 20, "governor.rounds: is 100000000000000000000; allowed"),
        ("governor.step=5e-324", "governor.step: is 5e-324; allowed: a number from 1e-9 to 1e9 or null;"),
        (
            "sensors.camera.position_std=1e300",
            "sensors.camera.position_std: is 1e+300; allowed: a number from 0 to 1000;",
        ),
        ("operator.reference=[2e6, 0]", "operator.reference.0: is 2000000.0; allowed: a number from -1e6 to 1e6;"),
        ("timing={tick: 1e-7, physics_step: 1e-7}", "timing.tick: is 1e-07; allowed: a number from 1e-6 to 10;"),
        (".".join(["a"] * 3000) + "=1", "override 'a.a.a."),
        (f"team.start={[[0, 0]] * 5000}", "team.start: has 5000 entries; allowed: a list of 1 to 500 pairs of numbers"),
        ("sensors.beams={count: 1080, robots: [1, 2, 3, 4, 5, 6]}", "sensors.beams.robots.5: is robot 6"),
    ],
)
def test_what_no_machine_can_run_is_refused(override, says):
    assert complaint(override).startswith(says)


def at_one_place(n):
    return parse_scenario_of(f"team: {{start: {[[0, 0]] * n}, formation: {[[0, 0]] * n}, leaders: [1]}}\n")


def parse_scenario_of(text):
    """Return the scenario before its checks."""
    document = validation._tuples(__import__("ruamel.yaml").yaml.YAML(typ="safe", pure=True).load(text))
    return Scenario.model_validate(document | {"operator": {"reference": (1.0, 0.0)}})


def test_robots_all_at_one_place_give_few_findings():
    found = [one for one in check(at_one_place(500)) if one.path[0] == "team"]
    assert len(found) == MOST_FINDINGS
    assert found[0].message.startswith("puts robot 2 onto robot 1, their bodies' centres 0 m apart")


def test_robots_that_overlap_are_found_as_by_comparing_all_pairs():
    rng = np.random.default_rng(11)
    for spread in (0.3, 1.0, 3.0):
        places = rng.uniform(-spread, spread, (40, 2))
        scenario = parse_scenario_of(
            f"team: {{start: {places.tolist()}, formation: {places.tolist()}, leaders: [1]}}\n"
        )
        near = {
            max(i, j)
            for i, j in itertools.combinations(range(40), 2)
            if np.hypot(*(places[i] - places[j])) < 0.12 - 1e-9
        }
        told = {one.path[2] for one in check(scenario) if "onto robot" in one.message}
        assert told == near


def test_the_robots_abreast_are_those_of_comparing_all_lines():
    rng = np.random.default_rng(5)
    for _ in range(40):
        b = rng.integers(-2, 3, (int(rng.integers(2, 12)), 2)).astype(float)
        most = 1 if len(np.unique(b, axis=0)) > 1 else len(b)
        for i, j in itertools.combinations(range(len(b)), 2):
            along = b[j] - b[i]
            beside = (b - b[i]) @ (along[1], -along[0])
            if along.any() and (beside.min() >= 0 or beside.max() <= 0):
                most = max(most, int(np.sum(beside == 0)))
        corner = max(int(np.sum((b == one).all(axis=1))) for one in b)
        assert max_robots_on_hull_edge(b) == max(most, corner if len(np.unique(b, axis=0)) == 1 else most)


def grid(n):
    return [[0.5 * (k % 25), 0.5 * (k // 25)] for k in range(n)]


def test_rounds_robots_and_links_are_bounded_together():
    big = THREE.replace("[[0, 0], [1, 0], [2, 0]]", str(grid(500))).replace("[[-1, 0], [0, 0], [1, 0]]", str(grid(500)))
    big = big.replace("[0, 90, 180]", "0") + "graph: {kind: complete}\nsensors: {beams: {robots: []}}\n"
    with pytest.raises(InputError, match=r"x.yaml:2: governor.rounds: is 10, by which 500 robots .* 1e\+10 numbers"):
        parse_scenario(big, "x.yaml")
    assert parse_scenario(big.replace("complete", "ring"), "x.yaml").robots == 500
    with pytest.raises(InputError, match=r"sensors.beams: has 36000 beams on 500 robots; allowed: at most 15000"):
        parse_scenario(big.replace("complete", "ring").replace("robots: []", "count: 72"), "x.yaml")


def test_a_team_too_large_for_its_eigenvalues_says_so():
    scenario = pbrg.load(
        {
            "plant": "ideal",
            "team": {"start": grid(200), "formation": grid(200), "leaders": [1]},
            "estimator": {"source": "given"},
            "operator": {"reference": [1, 1]},
        }
    )
    assert "is not computed for more than 150 robots" in scenario.warnings()[0]


def test_a_run_that_needs_more_memory_than_there_is_does_not_begin(monkeypatch, tmp_path):
    monkeypatch.setattr(resources, "available_bytes", lambda: 1e8)
    plan = pbrg.load("paper/simulation_near", duration=0.1)
    with pytest.raises(
        InputError, match=r"the run needs some 0.25 GB of memory, and 0.1 GB are free here; fewer robots"
    ):
        pbrg.run(plan, log=tmp_path / "a.mcap")
    assert list(tmp_path.iterdir()) == []
    assert plan.warnings()[0] == "a run needs some 0.25 GB of memory, and 0.1 GB are free here"
    with pytest.raises(InputError, match=r"the run needs"):
        Simulation.build(plan.settings)


def test_a_batch_too_large_for_memory_does_not_begin(monkeypatch):
    monkeypatch.setattr(resources, "available_bytes", lambda: 8e9)
    with pytest.raises(InputError, match=r"the batch needs some \d+ GB of memory, and 8 GB are free here; fewer seeds"):
        pbrg.batch("paper/experiment_near", range(100_000))


def test_messages_under_way_count():
    late = parse_scenario(three(network="{delay_rounds: 1000}"))
    assert resources.run_bytes(late) - resources.run_bytes(parse_scenario(THREE)) > 6 * 1000 * 14 * 16
    uneven = parse_scenario(three(network="{delay_rounds: 400, jitter_rounds: 600}"))
    assert resources.run_bytes(uneven) == resources.run_bytes(late)


def test_hours_of_rounds_are_told():
    plan = pbrg.load("paper/simulation_near", ["governor.rounds=10000"], duration=12000)
    assert any("numbers in governor.rounds: at 1e9 a second" in line for line in plan.warnings())


def test_physics_of_seconds_a_tick_is_refused():
    with pytest.raises(InputError, match=r"timing.physics_step: is 1e-06 s, by which 50 robots") as told:
        pbrg.load("scale/fifty_robots", ["timing.physics_step=1e-6"])
    assert "50 robots take 5e+05 physics steps a tick in all; allowed: at most 1e+05" in str(told.value)
    for fewer in (["timing.physics_step=5e-6"], ["timing.physics_step=1e-6", "timing.tick=0.002"]):
        assert pbrg.load("scale/fifty_robots", fewer).settings.robots == 50


def test_hours_of_physics_are_told():
    plan = pbrg.load("paper/experiment_near", ["timing.physics_step=2e-5"], duration=1e4)
    assert "1e+06 ticks are 2.5e+09 physics steps of a robot: at 1e5 a second, 6.9 hours" in plan.warnings()
    assert not any("hours" in line for line in pbrg.load("paper/experiment_near", duration=1e4).warnings())


def test_the_address_space_is_a_limit(monkeypatch):
    resource = pytest.importorskip("resource")
    monkeypatch.setattr(resource, "getrlimit", lambda which: (2**62, 2**62))
    assert 2**61 < resources._address_space() < 2**62
    monkeypatch.setattr(resource, "getrlimit", lambda which: (1, 1))
    assert resources.available_bytes() == 0.0
