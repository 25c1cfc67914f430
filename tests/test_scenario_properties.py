"""Dumped and read again it is the same; whatever comes in, only InputError comes out, in one line."""

import contextlib
import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.load import load_scenario, parse_scenario
from pbrg_mj.scenario.parse.document import read_document, write_document
from pbrg_mj.scenario.schema import Scenario
from tests.scenario_texts import THREE, three

RICH = three(
    timing="{duration: 5, tick: 0.02}",
    graph="{kind: edges, edges: [[1, 2], [2, 3]]}",
    world="{walls: [{from: [-3, 7], to: [3, 7], thickness: 0.2}], floor_friction: 0.8}",
    sensors="{beams: {robots: [3], noise_std: 0}, camera: {rate_hz: 60}}",
    estimator="{source: given, given: [{robot: 1, normal: [1, 0], offset: 2}]}",
    governor="{step: null, initial: start}",
    log="{timings: false}",
)
SEEDED = settings(derandomize=True, deadline=None, database=None)

numbers = st.floats(-1e3, 1e3)
text = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)


@st.composite
def scenarios(draw: st.DrawFn) -> dict[str, Any]:
    """Valid scenarios as plain data, robots far enough from each other."""
    n = draw(st.integers(1, 6))
    pairs = st.lists(numbers, min_size=2, max_size=2)
    leaders = draw(st.lists(st.integers(1, n), min_size=1, max_size=n, unique=True))
    kind = draw(st.sampled_from(["ring", "path", "complete"]))
    return {
        "description": draw(text),
        "seed": draw(st.integers(0, 2**63 - 1)),
        "team": {
            "start": [[3.0 * k + draw(st.floats(0, 1)), draw(numbers)] for k in range(n)],
            "heading_deg": draw(numbers | st.lists(numbers, min_size=n, max_size=n)),
            "formation": draw(st.lists(pairs, min_size=n, max_size=n)),
            "leaders": leaders,
        },
        "graph": {"kind": kind},
        "world": {"floor_friction": draw(st.floats(1e-9, 1e9))},
        "governor": {"rounds": draw(st.integers(1, 10**4)), "step": draw(st.none() | st.floats(1e-9, 1))},
        "log": {"timings": draw(st.booleans())},
        "operator": {"reference": draw(pairs)},
    }


@settings(SEEDED, max_examples=60)
@given(scenarios())
def test_a_scenario_dumped_and_read_is_equal(data: dict[str, Any]) -> None:
    scenario = parse_scenario(write_document(data))
    assert scenario.team.start == tuple(tuple(pair) for pair in data["team"]["start"])
    assert (scenario.description, scenario.seed) == (data["description"], data["seed"])
    assert scenario.governor.step == data["governor"]["step"]
    whole = scenario.model_dump(mode="json", by_alias=True)
    assert parse_scenario(write_document(whole)) == scenario


plain = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**20), 10**20) | st.floats(allow_nan=False) | text,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(text, inner, max_size=3),
    max_leaves=8,
)


@settings(SEEDED, max_examples=150)
@given(st.dictionaries(text, plain, max_size=4))
def test_plain_data_written_and_read_are_the_same(data: dict[str, Any]) -> None:
    read = read_document(write_document(data), "x.yaml").data
    assert read == data
    assert repr(read) == repr(data)  # 1 is not 1.0, and -0.0 not 0.0


def test_every_section_is_dumped() -> None:
    scenario = parse_scenario(RICH)
    again = parse_scenario(write_document(scenario.model_dump(mode="json", by_alias=True)))
    assert again == scenario
    assert set(scenario.model_dump()) == set(Scenario.model_fields)


def only_input_error(text: str) -> None:
    with contextlib.suppress(InputError):
        try:
            parse_scenario(text, "x.yaml")
        except InputError as error:
            assert len(str(error).splitlines()) == 1
            assert str(error).startswith("x.yaml")
            raise


@settings(SEEDED, max_examples=150)
@given(st.text(max_size=60) | st.text("aé:-[]{},\"'|>&*!%#@`?~<= \t\n01.e_\x00\x85\u2028\ufeff", max_size=40))
def test_any_text_is_a_scenario_or_an_input_error(text: str) -> None:
    only_input_error(text)


@settings(SEEDED, max_examples=100)
@given(st.integers(0, len(RICH)), st.integers(0, 12), st.text("a:-[]{},\"'&*!#~ \n01.e\x85", max_size=5))
def test_a_damaged_scenario_is_a_scenario_or_an_input_error(at: int, length: int, new: str) -> None:
    only_input_error(RICH[:at] + new + RICH[at + length :])


PATHS = sorted(".".join(map(str, path)) for path in read_document(RICH, "").origins if path)


@settings(SEEDED, max_examples=150)
@given(path=st.sampled_from(PATHS), data=plain)
def test_any_value_anywhere_is_right_or_an_input_error(
    tmp_path_factory: pytest.TempPathFactory, path: str, data: Any
) -> None:
    file = tmp_path_factory.getbasetemp() / "rich.yaml"
    file.write_text(RICH)
    value = json.dumps(data)  # which is YAML, in one line
    try:
        loaded = load_scenario(file, [f"{path}={value}"])
    except InputError as error:
        assert len(str(error).splitlines()) == 1
    else:
        assert parse_scenario(loaded.yaml_text) == loaded.scenario


@settings(SEEDED, max_examples=60)
@given(st.binary(max_size=60))
def test_any_bytes_are_a_scenario_or_an_input_error(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    file = tmp_path_factory.getbasetemp() / "bytes.yaml"
    file.write_bytes(content)
    with contextlib.suppress(InputError):
        load_scenario(file)


@settings(SEEDED, max_examples=100)
@given(st.text(max_size=30) | st.text("a.=0[]{}: \n", max_size=15))
def test_any_override_is_right_or_an_input_error(tmp_path_factory: pytest.TempPathFactory, override: str) -> None:
    file = tmp_path_factory.getbasetemp() / "three.yaml"
    file.write_text(THREE)
    try:
        load_scenario(Path(file), [override])
    except InputError as error:
        assert len(str(error).splitlines()) == 1
