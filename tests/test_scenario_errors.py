"""One line for every mistake: file, line, key, the value and what is allowed."""

import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.load import parse_scenario
from tests.scenario_texts import THREE, swapped, three


def complaint(text: str) -> str:
    with pytest.raises(InputError) as caught:
        parse_scenario(text, "x.yaml")
    return str(caught.value)


MISTAKES = {
    "near key": (swapped("seed", "sed"), "x.yaml:2: sed: is unknown; did you mean `seed`?"),
    "near key of a required one": (
        swapped("leaders", "leader"),
        "x.yaml:7: team.leader: is unknown; did you mean `leaders`?",
    ),
    "near key inside": (
        three(governor="{runds: 3}"),
        "x.yaml:10: governor.runds: is unknown; did you mean `rounds`?",
    ),
    "far key": (
        three(timing="{xyzzy: 3}"),
        "x.yaml:10: timing.xyzzy: is unknown; known: duration, tick, physics_step",
    ),
    "second spelling of a key": (
        three(world="{walls: [{start: [0, 5], to: [1, 5]}]}"),
        (
            "x.yaml:10: world.walls.0.start: is unknown; "
            "known: from, to, thickness, height, glass, reflectance (and 1 more)"
        ),
    ),
    "key twice": (THREE + "seed: 4\n", "x.yaml:10: seed: is there twice, first in line 2"),
    "missing key": (
        swapped("  leaders: [3]\n", ""),
        (
            "x.yaml:3: team.leaders: is missing; required: a list of 1 or more whole numbers at least 1 "
            "(robots that receive the reference, counted from 1)"
        ),
    ),
    "quoted number": (
        three(control="{alpha_r: '1'}"),
        "x.yaml:10: control.alpha_r: is '1'; allowed: a number from 1e-9 to 1e9 (a number stands without quotes)",
    ),
    "true for a number": (
        three(control="{alpha_r: true}"),
        "x.yaml:10: control.alpha_r: is true; allowed: a number from 1e-9 to 1e9",
    ),
    "true for a whole number": (
        three(governor="{rounds: true}"),
        "x.yaml:10: governor.rounds: is true; allowed: a whole number from 1 to 10000",
    ),
    "number for true": (three(log="{timings: 1}"), "x.yaml:10: log.timings: is 1; allowed: true or false"),
    "fraction for a whole number": (
        three(governor="{rounds: 2.5}"),
        "x.yaml:10: governor.rounds: is 2.5; allowed: a whole number from 1 to 10000",
    ),
    "not finite": (
        three(timing="{duration: .inf}"),
        "x.yaml:10: timing.duration: is inf; allowed: a number from 1e-9 to 1e9",
    ),
    "out of bounds": (
        three(sensors="{beams: {dropout: 1.5}}"),
        "x.yaml:10: sensors.beams.dropout: is 1.5; allowed: a number from 0 to 1",
    ),
    "none of the choices": (
        three(graph="{kind: star}"),
        "x.yaml:10: graph.kind: is 'star'; allowed: one of ring, path, complete, edges",
    ),
    "neither of two kinds": (
        swapped("[0, 90, 180]", "north"),
        (
            "x.yaml:5: team.heading_deg: is 'north'; "
            "allowed: a number from -1e9 to 1e9 or a list of numbers from -1e9 to 1e9"
        ),
    ),
    "inside one of two kinds": (
        swapped("[0, 90, 180]", "[0, east, 180]"),
        "x.yaml:5: team.heading_deg.1: is 'east'; allowed: a number from -1e9 to 1e9",
    ),
    "half a pair": (
        swapped("[1, 2.5]", "[1]"),
        "x.yaml:9: operator.reference: is [1]; allowed: a pair of numbers from -1e6 to 1e6 or null",
    ),
    "no leader": (
        swapped("[3]", "[]"),
        (
            "x.yaml:7: team.leaders: is empty; allowed: a list of 1 or more whole numbers at least 1 "
            "(robots that receive the reference, counted from 1)"
        ),
    ),
    "empty section": (
        THREE + "timing:\n",
        "x.yaml:10: timing: is empty; allowed: a section with the keys duration, tick, physics_step",
    ),
    "first by line, and how many more": (
        THREE.replace("seed: 3", "seed: -1").replace("[3]", "[x]") + "zzz: 1\n",
        "x.yaml:2: seed: is -1; allowed: a whole number at least 0 and less than 9223372036854775808 (and 2 more)",
    ),
    "not closed": (swapped("[3]", "[3"), "x.yaml:8: is not YAML: expected ',' or ']', but got ':'"),
    "special character": ("seed: 1\nplant: \x07", "x.yaml:2: is not YAML: unacceptable character #x0007"),
    "tag": (
        swapped("seed: 3", "seed: !!python/name:os.system 3"),
        "x.yaml:2: seed: has the tag 'tag:yaml.org,2002:",
    ),
    "tag that lies": (swapped("seed: 3", "seed: !!int three"), "x.yaml:2: seed: is 'three', which its tag says is int"),
    "other YAML": ("%YAML 1.1\n---\n" + THREE, "x.yaml:1: is YAML [1, 1]; allowed: YAML 1.2"),
    "two documents": (THREE + "---\n" + THREE, "x.yaml:10: is not YAML: but found another document"),
    "empty": ("# nothing\n", "x.yaml:1: is empty; allowed: a scenario in YAML"),
    "prose": ("hello world", "x.yaml:1: is no scenario: its top level is 'hello world'; allowed: keys and values"),
    "list": ("[1, 2]", "x.yaml:1: is no scenario: its top level is [1, 2]; allowed: keys and values in YAML"),
    "list for a key": (THREE + "? [1]\n: 2\n", "x.yaml:2: has a list or a section for a key; allowed: text"),
    "unknown alias": (swapped("[3]", "*who"), "x.yaml:7: is not YAML: found undefined alias 'who'"),
    "loop of aliases": (THREE + "a: &a [*a]\n", "x.yaml:10: a.0.0: is nested too deeply; allowed: 20 levels"),
    "deep": (THREE + "a: " + "[" * 1000, "x.yaml: is nested too deeply; allowed: 20 levels"),
    "long number": (
        swapped("seed: 3", "seed: " + "9" * 5000),
        "x.yaml:2: seed: is a number of more than 64 characters",
    ),
    "anchor twice": (
        THREE + "a: &a 1\nb: &a 2\n",
        "x.yaml: is not YAML: an anchor (&name) is there twice; allowed: each name once",
    ),
    "large": (THREE + "#" * 300_000, "x.yaml: is larger than 256 KiB, the most a scenario may be"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_is_told_in_one_line(case: str) -> None:
    text, expected = MISTAKES[case]
    assert complaint(text).startswith(expected)
    assert " more)" in expected or " more)" not in complaint(text)
    assert len(complaint(text).splitlines()) == 1


def test_three_numbers_are_no_pair() -> None:
    assert complaint(swapped("start: [[0, 0]", "start: [[0, 0, 7]")) == (
        "x.yaml:4: team.start.0: is [0, 0, 7]; allowed: a pair of numbers from -1e6 to 1e6"
    )


def test_aliases_that_multiply_are_stopped() -> None:
    bomb = "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n"
    for k in range(1, 12):
        bomb += f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]\n"
    assert "holds more than 100000 entries" in complaint(bomb)


def test_an_error_carries_its_parts() -> None:
    with pytest.raises(InputError) as caught:
        parse_scenario(three(governor="{rounds: 0}"), "x.yaml")
    assert (caught.value.file, caught.value.line, caught.value.key) == ("x.yaml", 10, "governor.rounds")


def test_a_value_shown_cannot_move_the_terminal() -> None:
    text = complaint(swapped("[1, 2.5]", r'"\e[2J\n\u2028\x85"'))
    assert text.isprintable()
