"""The JSON Schema says what the validation says, key by key."""

from __future__ import annotations

import copy
import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

import pbrg_mj as pbrg
from pbrg_mj.errors import InputError
from pbrg_mj.scenario.bundled import bundled_scenarios
from pbrg_mj.scenario.parse.document import read_document

SCENARIOS = Path(__file__).parents[1] / "scenarios"
VALIDATOR = Draft202012Validator(pbrg.schema())
HEADER = "# yaml-language-server: $schema="


def data(text):
    return read_document(text, "x").data


def changed(path, value):
    """The template with one value replaced, or taken away if it is Ellipsis."""
    whole = data(pbrg.template())
    *way, last = path
    place = whole
    for part in way:
        place = place.setdefault(part, {}) if isinstance(place, dict) else place[part]
    if value is ...:
        del place[last]
    else:
        place[last] = value
    return whole


def test_it_is_a_schema():
    Draft202012Validator.check_schema(pbrg.schema())


@pytest.mark.parametrize("name", bundled_scenarios())
def test_bundled_scenarios_and_their_headers_fit_it(name):
    file = bundled_scenarios()[name]
    text = file.read_text(encoding="utf-8")
    assert list(VALIDATOR.iter_errors(data(text))) == []
    header = text.splitlines()[0]
    assert header.startswith(HEADER)
    named = file.parent / header.removeprefix(HEADER)
    assert named.resolve() == (SCENARIOS / "schema.json").resolve()


def test_the_template_fits_it():
    assert list(VALIDATOR.iter_errors(data(pbrg.template()))) == []


def test_the_file_for_editors_is_the_schema_of_now():
    assert json.loads((SCENARIOS / "schema.json").read_text(encoding="utf-8")) == pbrg.schema()


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("sed",), 3),
        (("governor", "runds"), 3),
        (("team",), ...),
        (("team", "leaders"), ...),
        (("team", "leaders"), []),
        (("team", "leaders", 0), 0),
        (("team", "start", 0), [0.0]),
        (("team", "start", 0), [0.0, 0.0, 0.0]),
        (("control", "alpha_r"), "1.0"),
        (("control", "alpha_r"), True),
        (("control", "alpha_r"), 0.0),
        (("control", "alpha_r"), None),
        (("governor", "rounds"), 2.5),
        (("graph", "kind"), "star"),
        (("world", "walls", 0, "start"), [0.0, 0.0]),
        (("network", "loss"), 1.5),
    ],
)
def test_what_it_refuses_the_validation_refuses(path, value):
    wrong = changed(path, value)
    assert list(VALIDATOR.iter_errors(wrong)) != []
    with pytest.raises(InputError):
        pbrg.load(wrong)


@pytest.mark.parametrize(
    ("path", "value"), [(("control", "alpha_r"), 2), (("governor", "step"), None), (("team", "heading_deg"), [1, 2, 3])]
)
def test_what_it_takes_the_validation_takes(path, value):
    right = changed(path, value)
    assert list(VALIDATOR.iter_errors(right)) == []
    assert pbrg.load(right).settings.robots == 3


def sections():
    made = copy.deepcopy(pbrg.schema())
    return {"Scenario": made, **made["$defs"]}


def test_every_key_has_its_meaning_and_its_unit():
    for name, section in sections().items():
        for key, field in section["properties"].items():
            assert field.get("description") or "$ref" in field, (name, key)
    timing, team = (sections()[name]["properties"] for name in ("Timing", "Team"))
    assert (timing["duration"]["x-unit"], team["start"]["x-unit"], team["heading_deg"]["x-unit"]) == ("s", "m", "deg")
    assert timing["duration"]["default"] == 60.0
