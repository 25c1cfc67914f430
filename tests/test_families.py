"""Families of worlds: a seed is a world, the same one everywhere, and free of what it must be free of."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

import pbrg_mj as pbrg
from pbrg_mj.cli.main import main
from pbrg_mj.errors import InputError
from pbrg_mj.scenario.bundled import bundled_families
from pbrg_mj.scenario.families.distributions import CUT, random_of, value
from pbrg_mj.scenario.families.draw import draw_world
from pbrg_mj.scenario.families.schema import Distribution
from pbrg_mj.scenario.families.team import points_apart
from pbrg_mj.scenario.load import load_text
from pbrg_mj.scenario.parse.document import Document, read_document
from pbrg_mj.scenario.parse.validation import build

FAMILY = """\
description: "one"
team: {leaders: [1]}
draw:
  team: {robots: {integer: [2, 4]}, start_radius: 0.5, formation_radius: {uniform: [0.3, 0.5]}}
  reference: {distance: {uniform: [2.0, 3.0]}, direction_deg: {uniform: [-180, 180]}}
  walls:
    - {distance: {normal: [1.5, 0.1]}, angle_deg: {choice: [-30, 30]}}
  boxes:
    - {count: 2, along: {uniform: [0.5, 2.0]}, across: {uniform: [-1, 1]}, length: 0.3,
       width: {log_uniform: [0.05, 0.5]}}
  keys:
    sensors.beams.preset: {choice: [generic, lidar]}
    team.heading_deg: {uniform: [-180, 180], per_robot: true}
"""
GOLDEN = {
    "start": ((-0.1463, 0.4399), (0.3905, 0.1467), (-0.1559, -0.0119)),
    "formation": ((-0.4513, -0.13), (0.186, 0.3992), (0.2653, -0.2693)),
    "heading_deg": (-171.729, 57.7126, 9.37148),
    "reference": (-1.7039, 1.5853),
    "wall": ((2.5752, 2.3356), (-5.0726, -0.0119)),
    "boxes": [((-0.9098, 0.1292), (0.3, 0.05445), 137.064), ((-0.7836, 1.0091), (0.3, 0.244849), 137.064)],
}
CORRIDORS = "  corridors: [{width: 4, length: 3}]\n  keys:\n    drive.friction: {uniform: [0, 1]}"
PLACE = "along: {uniform: [0.5, 2.0]}, across: {uniform: [-1, 1]}"
NAMES = tuple(bundled_families())


def world(text=FAMILY, seed=1, *overrides):
    return load_text(text, "one", [f"seed={seed}", *overrides], file="one.yaml")


def test_draws_are_these_on_every_machine_and_in_every_order_of_hashes():
    """Written down once; Python's hashes are others in every process."""
    drawn = world(seed=7).scenario
    assert drawn.seed == 7
    assert drawn.team.start == GOLDEN["start"]
    assert drawn.team.formation == GOLDEN["formation"]
    assert drawn.team.heading_deg == GOLDEN["heading_deg"]
    assert drawn.operator.reference == GOLDEN["reference"]
    assert (drawn.world.walls[0].start, drawn.world.walls[0].end) == GOLDEN["wall"]
    assert [(box.center, box.size, box.angle_deg) for box in drawn.world.boxes] == GOLDEN["boxes"]
    assert drawn.sensors.beams.preset == "lidar"


def test_the_same_seed_is_the_same_world_and_another_one_is_another():
    assert world(seed=3).yaml_text == world(seed=3).yaml_text
    places = {world(seed=seed).scenario.operator.reference for seed in range(1, 10)}
    assert len(places) == 9
    assert {world(seed=seed).scenario.robots for seed in range(1, 10)} == {2, 3, 4}


def test_another_entry_changes_no_number_of_the_others():
    more = FAMILY.replace("  keys:", CORRIDORS)
    before, after = world(seed=5).scenario, world(more, 5).scenario
    assert after.world.walls[0] == before.world.walls[0] and after.world.boxes == before.world.boxes
    assert after.team == before.team and after.sensors == before.sensors
    assert len(after.world.walls) == 3 and after.drive.friction != before.drive.friction


MORE = """\
  notched: [{along: -2.0, across: 0.5, length: 0.6, width: 0.4, thickness: 0.1, arms: 3, angle_deg: 90}]
  thresholds: [{along: 1.0, length: 2.0, height: 0.005, angle_deg: 90}]
  keys:"""


def test_notched_prisms_thresholds_and_dark_walls_are_placed_along_the_way():
    given = FAMILY.replace("  keys:", MORE).replace("{choice: [-30, 30]}", "0.0, reflectance: {uniform: [0.1, 0.4]}")
    before, drawn = world(seed=6).scenario, world(given, 6, "draw.reference.direction_deg=0").scenario
    (prism,), (bar,) = drawn.world.prisms, drawn.world.thresholds
    assert (bar.start, bar.end, bar.height) == ((1.0, -1.0), (1.0, 1.0), 0.005)
    outline = {(0.3, -0.2), (0.3, 0.2), (-0.3, 0.2), (-0.2, 0.2), (-0.2, -0.1), (0.2, -0.1), (0.2, 0.2), (-0.3, -0.2)}
    assert set(prism.corners) == {(round(-2 - y, 4), round(0.5 + x, 4)) for x, y in outline}
    assert len(prism.convex()) == 3
    assert 0.1 <= drawn.world.walls[0].reflectance <= 0.4 and before.world.walls[0].reflectance == 0.88
    ell = world(given, 6, "draw.notched.0.arms=2").scenario.world.prisms[0]
    assert len(ell.corners) == 6 and len(ell.convex()) == 2


@pytest.mark.parametrize(("key", "said"), [("arms=4", "has 4 arms; allowed: 2 or 3"), ("thickness=0.2", "has arms of")])
def test_a_notched_prism_has_two_or_three_arms_apart(key, said):
    with pytest.raises(InputError, match=f"one.yaml:11: draw.notched.0: {said}"):
        world(FAMILY.replace("  keys:", MORE), 6, f"draw.notched.0.{key}")


SLOPES = """\
  doorways: [{distance: 1.5, width: 1.2, angle_deg: 0, pane: 0.02}]
  ramps: [{along: 2.5, across: 0.5, length: 0.8, width: 2.0, slope_deg: 3.0, angle_deg: 90}]
  keys:"""


def test_panes_fill_doorways_and_ramps_lead_up_and_down():
    given = FAMILY.replace("  keys:", SLOPES)
    drawn = world(given, 6, "draw.reference.direction_deg=0").scenario.world
    _, left, right, pane = drawn.walls
    assert (pane.start, pane.end) == (left.end, right.start) and math.dist(pane.start, pane.end) == pytest.approx(1.2)
    assert (pane.glass, pane.thickness) == (True, 0.02) and not (left.glass or right.glass)
    up, down = drawn.ramps
    assert (up.start, up.end, down.start, down.end) == ((2.5, -0.3), (2.5, 0.5), (2.5, 1.3), (2.5, 0.5))
    assert up.height == down.height == pytest.approx(0.8 * math.tan(math.radians(3.0)), abs=1e-5) and up.width == 2.0
    assert not any(wall.glass for wall in world(given, 6, "draw.doorways.0.pane=0").scenario.world.walls)


def test_a_ramp_keeps_off_robots_and_has_a_slope():
    given = FAMILY.replace("  keys:", SLOPES)
    with pytest.raises(InputError, match=r"one.yaml:12: draw\.ramps\.0: has slopes of 45 deg; allowed: more than 0"):
        world(given, 6, "draw.ramps.0.slope_deg=45")
    with pytest.raises(InputError, match=r"draw\.ramps\.0: finds no place in 1000 draws that keeps 0\.3 m"):
        world(given, 6, "draw.ramps.0.along=0.5")


def test_overrides_win_over_what_is_drawn_and_leave_the_world_as_it_is():
    drawn, changed = world(seed=4).scenario, world(FAMILY, 4, "sensors.beams.preset=robotarium").scenario
    assert changed.sensors.beams.preset == "robotarium"
    assert (changed.team, changed.world, changed.operator) == (drawn.team, drawn.world, drawn.operator)
    assert len(world(FAMILY, 4, "draw.boxes.0.count=5").scenario.world.boxes) == 5


def test_the_written_world_is_the_drawn_one(tmp_path):
    drawn = pbrg.draw("families/combined", 11, path=tmp_path / "w.yaml")
    again = pbrg.load(tmp_path / "w.yaml")
    assert again.settings == drawn.settings and again.family_yaml is None
    with pytest.raises(InputError, match="is there already"):
        pbrg.draw("families/combined", 11, path=tmp_path / "w.yaml")
    assert drawn.override(seed=12).settings == pbrg.draw("families/combined", 12).settings
    longer = drawn.override({"timing.duration": 99.0}).settings
    assert longer.world == drawn.settings.world and longer.timing.duration == 99.0


def test_a_log_embeds_the_concrete_world(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "families/long_wall", "--seed", "6", "--duration", "0.1", "--quiet"]) == 0
    logged = pbrg.open("long_wall.mcap").scenario
    drawn = pbrg.draw("families/long_wall", 6, ["timing.duration=0.1"])
    assert logged.settings == drawn.settings and "draw" not in read_document(logged.yaml, "x").data


def test_commands_name_families_and_refuse_others(capsys):
    assert main(["draw", "families/boxes", "--seed", "2"]) == 0
    assert capsys.readouterr().out == pbrg.draw("families/boxes", 2).yaml
    assert main(["show", "families/boxes"]) == 0
    assert capsys.readouterr().out == bundled_families()["families/boxes"].read_text(encoding="utf-8")
    assert main(["draw", "paper/experiment_near"]) == 2
    assert "has no section `draw`" in capsys.readouterr().err
    listed = {one.name: one for one in pbrg.list_scenarios()}
    assert all(listed[name].family and listed[name].robots is None for name in NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_worlds_of_bundled_families_are_valid_and_say_what_they_are(name):
    description = {pbrg.draw(name, seed).settings.description for seed in range(301, 304)}
    assert len(description) == 1 and description.pop()


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_two_hundred_worlds_of_every_family_are_valid_and_keep_their_distances(name):
    file = bundled_families()[name]
    family = read_document(file.read_text(encoding="utf-8"), file.name)
    for seed in range(1, 201):
        document = Document(family.data | {"seed": seed}, family.origins)
        drawn = build(draw_world(document, file.name), file.name)
        if seed > 40:  # the rest takes most of the time
            continue
        start = np.array(drawn.team.start)
        goal = np.array(drawn.operator.reference) + np.array(drawn.team.formation)
        for wall in drawn.world.obstacles:
            assert nearest(wall, start) >= 0.3 - 1e-9
        for box in drawn.world.boxes:
            assert nearest(box.as_wall(), goal) >= 0.2 - 1e-9
        for points in (start, np.array(drawn.team.formation)):
            apart = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1)) + 9 * np.eye(len(points))
            assert apart.min() >= 0.3 - 2e-4  # the formation is rounded about its mean


def nearest(wall, points):
    """Distance of the nearest point from a wall, from its faces as dense points; -1 if one is inside."""
    (x0, y0), (x1, y1), half = wall.start, wall.end, wall.thickness / 2
    length = math.hypot(x1 - x0, y1 - y0)
    t = np.array([(x1 - x0) / length, (y1 - y0) / length])
    local = (points - (x0, y0)) @ np.array([t, (-t[1], t[0])]).T
    if ((local[:, 0] > 0) & (local[:, 0] < length) & (np.abs(local[:, 1]) < half)).any():
        return -1.0
    s, v = np.linspace(0, length, 4001), np.linspace(-half, half, 101)
    edges = [(s, s * 0 + half), (s, s * 0 - half), (v * 0, v), (v * 0 + length, v)]
    face = np.concatenate([np.column_stack(edge) for edge in edges])
    return min(float(np.hypot(*(face - point).T).min()) for point in local)


LAWS = {
    "uniform": ({"uniform": (-2, 3)}, stats.uniform(-2, 5)),
    "log_uniform": ({"log_uniform": (0.1, 10)}, stats.loguniform(0.1, 10)),
    "normal": ({"normal": (1, 0.5)}, stats.truncnorm(-CUT, CUT, loc=1, scale=0.5)),
}


@pytest.mark.parametrize("name", LAWS)
def test_values_follow_their_laws(name):
    given, law = LAWS[name]
    random = random_of(12, name)
    drawn = [value(Distribution(**given), random) for _ in range(2000)]
    assert stats.kstest(drawn, law.cdf).pvalue > 1e-3


def test_whole_numbers_and_choices_are_equally_likely():
    random = random_of(13, "x")
    for given, among in (({"integer": (-1, 2)}, [-1, 0, 1, 2]), ({"choice": ("a", "b", "c")}, ["a", "b", "c"])):
        drawn = [value(Distribution(**given), random) for _ in range(2000)]
        assert sorted(set(drawn)) == among
        assert stats.chisquare([drawn.count(one) for one in among]).pvalue > 1e-3


def test_points_keep_apart_within_their_disc():
    points = points_apart(12, 1.0, 0.4, random_of(1, "x"))
    apart = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1)) + 9 * np.eye(12)
    assert apart.min() >= 0.4 and np.hypot(*points.T).max() <= 1.0 + 1e-4
    with pytest.raises(InputError, match="finds no places for 12 points"):
        points_apart(12, 0.3, 0.4, random_of(1, "x"))


MISTAKES = {
    "unknown": ("start_radius", "start_radiu", "one.yaml:4: draw.team.start_radiu: is unknown; did you mean"),
    "unknown law": ("{integer", "{intger", ":4: draw.team.robots.intger: is unknown; did you mean `integer`?"),
    "two laws": ("choice: [-30, 30]", "choice: [-30, 30], uniform: [0, 1]", "has uniform and choice; allowed: one of"),
    "no law": ("{integer: [2, 4]}", "{}", ":4: draw.team.robots: has no distribution; allowed: one of uniform"),
    "order": ("[0.3, 0.5]", "[0.5, 0.3]", "formation_radius.uniform: is [0.5, 0.3]; allowed: the lowest value first"),
    "log of 0": (
        "{log_uniform: [0.05",
        "{log_uniform: [0",
        "boxes.0.width.log_uniform: is [0.0, 0.5]; allowed: n",
    ),
    "deviation": (
        "[1.5, 0.1]",
        "[1.5, -0.1]",
        "one.yaml:7: draw.walls.0.distance.normal: is [1.5, -0.1]; allowed: a",
    ),
    "per robot": ("log_uniform: [0.05, 0.5]", "uniform: [1, 2], per_robot: true", "allowed: under draw.keys alone"),
    "half a robot": ("{integer: [2, 4]}", "2.5", "one.yaml:4: draw.team: has 2.5 robots; allowed: whole numbers from"),
    "many": ("count: 2", "count: 1e6", "one.yaml:9: draw.boxes.0: has a count of 1e+06; allowed: whole numbers from 0"),
    "no room": ("start_radius: 0.5", "start_radius: 0.1", "one.yaml:4: draw.team: finds no places for"),
    "no place": (
        PLACE,
        "along: 0",
        "finds no place in 1000 draws that keeps 0.3 m from the robots' start and 0.2 m",
    ),
    "no width": ("{log_uniform: [0.05, 0.5]}", "-1", "one.yaml:9: draw.boxes.0: draws {center: "),
    "no key": ("beams.preset", "beams.prest", ":12: sensors.beams.prest: is unknown; did you mean `preset`?"),
    "no value": ("[generic, lidar]", "[radar]", ":12: sensors.beams.preset: is 'radar'; allowed: one of"),
    "seed": (
        "sensors.beams.preset: {choice: [generic, lidar]}",
        "seed: 2",
        "draw.keys.seed: is not drawn; allowed",
    ),
    "twice": ("{leaders: [1]}", "{leaders: [1], start: [[0, 0]]}", "one.yaml:2: team.start: is drawn by draw.team"),
    "no section": ("team: {leaders: [1]}", "team: 3", "draw.team: goes into team, which is 3, no section"),
    "no draw": ("draw:\n", "draw: 3\nd:\n", "one.yaml:3: draw: is 3; allowed: a section with the keys team"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_one_line_with_the_key(name):
    before, after, said = MISTAKES[name]
    assert before in FAMILY
    with pytest.raises(InputError) as caught:
        load_text(FAMILY.replace(before, after, 1), "one", ["seed=1"], file="one.yaml")
    assert said in str(caught.value)


@pytest.mark.parametrize("seed", ["-1", "1.5", "true", "9223372036854775808"])
def test_a_seed_is_a_whole_number(seed):
    with pytest.raises(InputError, match=r"seed: is .*; allowed: a whole number at least 0 and less than"):
        world(FAMILY, seed)
