"""Earlier names of keys: read as the names of today, with lines and overrides still right."""

from __future__ import annotations

import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.load import load_scenario, parse_scenario
from pbrg_mj.scenario.parse.renamed_keys import RENAMED
from tests.scenario_texts import three

TODAY = {
    "disturbances": "{kidnappings: [{robot: 1, time: 1, to: [5, 5]}]}",
    "network": "{outages: [{robot: 2, time: 3}], neighbour_timeout: 0.2}",
    "world": "{moving_boxes: [{size: [1, 1], waypoints: [{time: 0, center: [9, 9]}]}]}",
}
EARLIER = {
    "disturbances": "{carries: [{robot: 1, time: 1, to: [5, 5]}]}",
    "network": "{silences: [{robot: 2, time: 3}], silent_after: 0.2}",
    "world": "{moving_boxes: [{size: [1, 1], stops: [{time: 0, center: [9, 9]}]}]}",
}


def written(tmp_path, text):
    file = tmp_path / "x.yaml"
    file.write_text(text)
    return file


def test_a_scenario_in_earlier_names_is_the_one_in_names_of_today():
    assert parse_scenario(three(**EARLIER)) == parse_scenario(three(**TODAY))
    assert all(any(old[-1] in text for text in EARLIER.values()) for old in RENAMED)


def test_the_name_is_another_key_elsewhere():
    with pytest.raises(InputError, match=r"timing.carries: is unknown"):
        parse_scenario(three(timing="{carries: 1}"))


def test_errors_keep_the_line_and_say_the_name_of_today():
    text = three() + "disturbances:\n  pushes: []\n  carries:\n    - {robot: 1, time: 1, to: [5, 5]}\n    - {robot: 9,"
    text += " time: 1, to: [5, 5]}\n"
    line = text.splitlines().index("  carries:") + 3
    with pytest.raises(InputError, match=rf"^x.yaml:{line}: disturbances.kidnappings.1.robot: is robot 9; allowed"):
        parse_scenario(text, "x.yaml")


def test_both_names_in_one_section_are_refused():
    text = three() + "network:\n  neighbour_timeout: 1.0\n  silent_after: 2.0\n"
    line = len(text.splitlines())
    problem = "is the earlier name of `neighbour_timeout`, which is there as well; allowed: one of them"
    with pytest.raises(InputError, match=rf"^x.yaml:{line}: network.silent_after: {problem}"):
        parse_scenario(text, "x.yaml")


@pytest.mark.parametrize("name", ["silent_after", "neighbour_timeout"])
@pytest.mark.parametrize("key", ["silent_after", "neighbour_timeout"])
def test_overrides_take_either_name_over_either(name, key, tmp_path):
    file = written(tmp_path, three(network=f"{{{name}: 3.0, silences: [{{robot: 2, time: 3}}]}}"))
    loaded = load_scenario(file, [f"network.{key}=0.25", "network.outages.0.time=4", "network.silences.0.duration=1"])
    assert loaded.scenario.network.neighbour_timeout == 0.25
    assert (loaded.scenario.network.outages[0].time, loaded.scenario.network.outages[0].duration) == (4, 1)
    assert parse_scenario(loaded.yaml_text) == loaded.scenario


def test_an_overrides_value_may_hold_earlier_names(tmp_path):
    file = written(tmp_path, three())
    network = load_scenario(file, ["network={silent_after: 0.25}"]).scenario.network
    assert network.neighbour_timeout == 0.25
    with pytest.raises(
        InputError, match=r"network.neighbour_timeout: is -1.*set by override 'network.silent_after=-1'"
    ):
        load_scenario(file, ["network.silent_after=-1"])


def test_a_preset_that_promised_no_beams_is_refused_and_logs_that_have_it_open(tmp_path):
    text = three(sensors="{beams: {preset: none}}")
    assert parse_scenario(text) == parse_scenario(three(sensors="{beams: {preset: generic}}"))
    line = next(k for k, one in enumerate(text.splitlines(), 1) if "preset" in one)
    with pytest.raises(
        InputError, match=rf"x.yaml:{line}: sensors.beams.preset: is none, an earlier name of `generic`"
    ):
        load_scenario(written(tmp_path, text))
    with pytest.raises(InputError, match=r"without beams: `robots: \[\]`; set by override"):
        load_scenario(written(tmp_path, three()), ["sensors.beams.preset=none"])
