"""What must hold between keys, and the two functions that later packages use."""

import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.checks.distances import distance_to_wall
from pbrg_mj.scenario.checks.world import body_centres
from pbrg_mj.scenario.load import parse_scenario
from pbrg_mj.scenario.schema import Graph, Wall, edge_list, unreachable, whole_multiple
from tests.scenario_texts import THREE, swapped, three

IDEAL = THREE + "plant: ideal\nestimator: {source: given}\n"

WRONG = {
    "run without end": (
        three(timing="{duration: 1e8}"),
        "x.yaml:10: timing.duration: is 1e+08 s; allowed: at most 100000000 times timing.tick, 0.01 s",
    ),
    "tick without end": (
        three(timing="{tick: 0.1, physics_step: 1e-6}"),
        "x.yaml:10: timing.tick: is 0.1 s; allowed: at most 10000 times timing.physics_step, 1e-06 s",
    ),
    "bias list of the wrong length": (
        swapped("[-1, 0], ", ""),
        "x.yaml:6: team.formation: has 2 entries; allowed: 3, one per robot in team.start",
    ),
    "heading list of the wrong length": (
        swapped("90, 180", "90"),
        "x.yaml:5: team.heading_deg: has 2 entries; allowed: one number, or 3, one per robot in team.start",
    ),
    "leader that is not there": (
        swapped("[3]", "[1, 4]"),
        "x.yaml:7: team.leaders.1: is robot 4; allowed: 1 to 3, the number of robots in team.start",
    ),
    "leader twice": (
        swapped("[3]", "[3, 1, 3]"),
        "x.yaml:7: team.leaders.2: is 3, which is in the list twice; allowed: each robot once",
    ),
    "beams on a robot that is not there": (
        three(sensors="{beams: {robots: [4]}}"),
        "x.yaml:10: sensors.beams.robots.0: is robot 4; allowed: 1 to 3, the number of robots in team.start",
    ),
    "half-space for a robot that is not there": (
        three(estimator="{source: given, given: [{robot: 9, normal: [1, 0], offset: 2}]}"),
        "x.yaml:10: estimator.given.0.robot: is robot 9; allowed: 1 to 3, the number of robots in team.start",
    ),
    "normal without length": (
        three(estimator="{source: given, given: [{robot: 1, normal: [0, 0], offset: 2}]}"),
        "x.yaml:10: estimator.given.0.normal: is [0.0, 0.0]; allowed: any direction, not zero",
    ),
    "half-spaces nobody asked for": (
        three(estimator="{given: [{robot: 1, normal: [1, 0], offset: 2}]}"),
        "x.yaml:10: estimator.given: is given, but estimator.source is beams; allowed: with `source: given`",
    ),
    "ideal plant with beams": (
        three(plant="ideal"),
        "x.yaml:10: plant: is ideal, which has no beams; allowed: with `estimator.source: given` only",
    ),
    "edge to a robot that is not there": (
        three(graph="{kind: edges, edges: [[1, 2], [2, 4]]}"),
        "x.yaml:10: graph.edges.1: is robot 4; allowed: 1 to 3, the number of robots in team.start",
    ),
    "edge to itself": (
        three(graph="{kind: edges, edges: [[1, 2], [2, 2]]}"),
        "x.yaml:10: graph.edges.1: is [2, 2], robot 2 with itself; allowed: two different robots",
    ),
    "edge twice": (
        three(graph="{kind: edges, edges: [[1, 2], [2, 3], [2, 1]]}"),
        "x.yaml:10: graph.edges.2: is [2, 1], an edge given twice; allowed: each pair once",
    ),
    "no edges": (
        three(graph="{kind: edges}"),
        "x.yaml:10: graph.edges: is empty; required with `kind: edges`: pairs of robots such as [1, 2]",
    ),
    "edges nobody asked for": (
        three(graph="{kind: path, edges: [[1, 2]]}"),
        "x.yaml:10: graph.edges: is given, but graph.kind is path; allowed: only with `kind: edges`",
    ),
    "disconnected graph": (
        three(graph="{kind: edges, edges: [[1, 3]]}"),
        "x.yaml:10: graph.edges: leave robot 2 out of reach of robot 1; allowed: a connected graph of 3 robots",
    ),
    "tick": (
        three(timing="{tick: 0.003, duration: 3}", reference="{period: 0.3}"),
        "x.yaml:10: timing.tick: is 0.003 s; allowed: a whole multiple of timing.physics_step, 0.002 s",
    ),
    "tick below the physics step": (
        three(timing="{tick: 0.001}"),
        "x.yaml:10: timing.tick: is 0.001 s; allowed: a whole multiple of timing.physics_step, 0.002 s",
    ),
    "duration": (
        three(timing="{duration: 1.005}"),
        "x.yaml:10: timing.duration: is 1.005 s; allowed: a whole multiple of timing.tick, 0.01 s",
    ),
    "solver period": (
        three(reference="{period: 0.025}"),
        "x.yaml:10: reference.period: is 0.025 s; allowed: a whole multiple of timing.tick, 0.01 s",
    ),
    "ranges": (
        three(sensors="{beams: {range_min: 4, range_max: 4}}"),
        "x.yaml:10: sensors.beams: has range_min 4.0 m; allowed: less than range_max, 4.0 m",
    ),
    "no operator": (
        swapped("  reference: [1, 2.5]", "  reference: null"),
        "x.yaml:8: operator: has neither reference nor waypoints; allowed: one of them",
    ),
    "two operators": (
        THREE + "  waypoints: [{time: 0, reference: [0, 0]}]\n",
        "x.yaml:8: operator: has both reference and waypoints; allowed: one of them",
    ),
    "late first waypoint": (
        swapped("reference: [1, 2.5]", "waypoints: [{time: 1, reference: [0, 0]}]"),
        "x.yaml:9: operator.waypoints.0.time: is 1.0 s; allowed: 0, the first waypoint's time",
    ),
    "waypoints out of order": (
        swapped("reference: [1, 2.5]", "waypoints: [{time: 0, reference: [0, 0]}, {time: 0, reference: [1, 0]}]"),
        "x.yaml:9: operator.waypoints.1.time: is 0.0 s; allowed: later than the one before, 0.0 s",
    ),
    "wall without length": (
        three(world="{walls: [{from: [5, 5], to: [5, 5]}]}"),
        "x.yaml:10: world.walls.0: runs from [5.0, 5.0] to [5.0, 5.0]; allowed: two different points",
    ),
    "wall through a robot": (
        three(world="{walls: [{from: [5, 5], to: [6, 5]}, {from: [1, -1], to: [1, 1]}]}"),
        (
            "x.yaml:10: world.walls.1: passes through robot 2 at its start; "
            "allowed: 0.06 m or more between wall and body's centre, not 0 m"
        ),
    ),
    "wall through a point robot": (
        IDEAL + "world: {walls: [{from: [1, -1], to: [1, 1]}]}\n",
        "x.yaml:12: world.walls.0: passes through robot 2 at its start; allowed: hand points off the walls",
    ),
    # Robot 1 looks along +x and robot 3 along -x: their bodies stand at (-0.04, 0) and (0.06, 0.05).
    "robots in each other": (
        swapped("[2, 0]]", "[0.02, 0.05]]"),
        (
            "x.yaml:4: team.start.2: puts robot 3 onto robot 1, "
            "their bodies' centres 0.112 m apart; allowed: 0.12 m or more"
        ),
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_does_not_fit_together_is_told(case: str) -> None:
    text, expected = WRONG[case]
    with pytest.raises(InputError) as caught:
        parse_scenario(text, "x.yaml")
    assert str(caught.value) == expected


FITTING = {
    "one robot": "team: {start: [[0, 0]], formation: [[0, 0]], leaders: [1]}\noperator: {reference: [1, 1]}\n",
    "one robot, no edges": "team: {start: [[0, 0]], formation: [[0, 0]], leaders: [1]}\n"
    "operator: {reference: [1, 1]}\ngraph: {kind: edges}\n",
    "no constraint": three(estimator="{source: given}"),
    "nobody carries beams": three(sensors="{beams: {robots: []}}"),
    "points may meet": IDEAL.replace("[1, 0], [2, 0]]", "[0, 0], [0, 0]]"),
    "ideal plant takes no physics steps": IDEAL + "timing: {tick: 0.0005}\n",
    "wall just off the body": three(world="{walls: [{from: [-1, 0.1101], to: [3, 0.1101]}]}").replace("90", "0"),
    "a long time of short ticks": three(timing="{duration: 86400, tick: 0.002}"),
    "waypoints": swapped(
        "reference: [1, 2.5]", "waypoints: [{time: 0, reference: [0, 0]}, {time: 1, reference: [1, 0]}]"
    ),
}


@pytest.mark.parametrize("case", FITTING)
def test_what_fits_together_passes(case: str) -> None:
    parse_scenario(FITTING[case])


def test_a_wall_just_inside_the_body_is_told() -> None:
    with pytest.raises(InputError, match="passes through robot 1"):
        parse_scenario(FITTING["wall just off the body"].replace("0.1101", "0.1099"))


@pytest.mark.parametrize(
    ("period", "step", "count"),
    [
        (0.01, 0.002, 5),
        (0.3, 0.1, 3),
        (60.0, 0.01, 6000),
        (0.003, 0.002, None),
        (0.001, 0.002, None),
        (1.0 + 1e-10, 1.0, 1),
        (1.0 + 1e-08, 1.0, None),
        (1e300, 1e-300, None),
        (0.1, 0.1, 1),
    ],
)
def test_whole_multiple(period: float, step: float, count: int | None) -> None:
    assert whole_multiple(period, step) == count


@pytest.mark.parametrize(
    ("kind", "n", "edges"),
    [
        ("ring", 1, ()),
        ("ring", 2, ((0, 1),)),
        ("ring", 4, ((0, 1), (0, 3), (1, 2), (2, 3))),
        ("path", 1, ()),
        ("path", 4, ((0, 1), (1, 2), (2, 3))),
        ("complete", 4, ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))),
    ],
)
def test_edges_by_kind(kind: str, n: int, edges: tuple) -> None:
    assert edge_list(Graph(kind=kind), n) == edges  # type: ignore[arg-type]
    assert unreachable(edges, n) == ()


def test_given_edges_come_sorted_and_counted_from_zero() -> None:
    assert edge_list(Graph(kind="edges", edges=((3, 1), (2, 1))), 3) == ((0, 1), (0, 2))


def test_robots_out_of_reach() -> None:
    assert unreachable([(0, 3), (1, 2)], 5) == (1, 2, 4)


def test_the_body_stands_behind_the_hand_point() -> None:
    centres = body_centres(parse_scenario(THREE))  # headings 0, 90 and 180 degrees
    assert [x for pair in centres for x in pair] == pytest.approx([-0.04, 0, 1, -0.04, 2.04, 0], abs=1e-12)


@pytest.mark.parametrize(
    ("point", "distance"),
    [
        ((1, 1), 0.0),
        ((2, 0), 2**0.5 - 0.1),
        ((-1, -1), 2**0.5),
        ((3, 2), ((0.5**0.5) ** 2 + (0.5**0.5 - 0.1) ** 2) ** 0.5),
    ],
)
def test_distance_to_a_slanted_wall(point: tuple[float, float], distance: float) -> None:
    wall = Wall.model_validate({"from": (0, 0), "to": (2, 2), "thickness": 0.2})
    assert distance_to_wall(wall, point) == pytest.approx(distance, abs=1e-12)
