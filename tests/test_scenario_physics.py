"""Obstacles, delays, disturbances and sensors that cannot be are told in one line."""

import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.checks.physics import PHYSICS_ONLY
from pbrg_mj.scenario.load import parse_scenario
from pbrg_mj.scenario.schema import Box
from pbrg_mj.scenario.schema.team import Variation
from tests.scenario_texts import THREE, three

IDEAL = THREE + "plant: ideal\nestimator: {source: given}\n"
CARRY = "robot: 1, time: 1, to: [5, 5]"


def ideal(**sections: str) -> str:
    return IDEAL + "".join(f"{key}: {value}\n" for key, value in sections.items())


def happen(kind: str, *entries: str) -> str:
    return three(disturbances="{" + kind + ": [" + ", ".join("{" + entry + "}" for entry in entries) + "]}")


HEIGHTS = "a number from 0.02 to 0.04 or a number from 0.045 to 0.053"
PRESETS_IN_TURN = ("ideal", "robotarium", "tof_ring", "tof_cones", "lidar", "lds_02")
NOTHING = "which the ideal plant ignores; allowed: with `plant: physics`"
# Robots 1 to 3 look along 0, 90 and 180 degrees: their bodies stand at (-0.04, 0), (1, -0.04), (2.04, 0).
WRONG = {
    "push of nobody": (
        happen("pushes", "robot: 4, time: 1, duration: 1, force: [1, 0]"),
        "disturbances.pushes.0.robot: is robot 4; allowed: 1 to 3, the number of robots in team.start",
    ),
    "dead motor of nobody": (
        happen("dead_motors", "robot: 3, side: left, time: 1", "robot: 5, side: left, time: 1"),
        "disturbances.dead_motors.1.robot: is robot 5; allowed: 1 to 3, the number of robots in team.start",
    ),
    "carry of nobody": (
        happen("kidnappings", "robot: 9, time: 1, to: [5, 5]"),
        "disturbances.kidnappings.0.robot: is robot 9; allowed: 1 to 3, the number of robots in team.start",
    ),
    "silence of nobody": (
        three(network="{outages: [{robot: 4, time: 1}]}"),
        "network.outages.0.robot: is robot 4; allowed: 1 to 3, the number of robots in team.start",
    ),
    "link to nobody": (
        three(network="{links: [{robots: [1, 4], delay_rounds: 1}]}"),
        "network.links.0.robots.1: is robot 4; allowed: 1 to 3, the number of robots in team.start",
    ),
    "unknown side": (
        happen("dead_motors", "robot: 3, side: rear, time: 1"),
        "disturbances.dead_motors.0.side: is 'rear'; allowed: one of left, right",
    ),
    "push shorter than a step": (
        happen("pushes", "robot: 1, time: 1, duration: 0.001, force: [1, 0]"),
        "disturbances.pushes.0.duration: is 0.001 s; allowed: at least timing.physics_step, 0.002 s",
    ),
    "lifted in the air": (
        happen(
            "kidnappings", f"{CARRY}, duration: 2", "robot: 2, time: 2, to: [7, 7]", "robot: 1, time: 2.5, to: [6, 6]"
        ),
        "disturbances.kidnappings.2.time: is 2.5 s, with robot 1 still in the air; allowed: 3.0 s or later",
    ),
    "carried onto a wall": (
        three(
            world="{walls: [{from: [9, 9], to: [8, 9]}, {from: [4, 5.1], to: [6, 5.1]}]}",
            disturbances="{kidnappings: [{" + CARRY + "}]}",
        ),
        (
            "x.yaml:11: disturbances.kidnappings.0.to: puts robot 1 onto wall 1; "
            "allowed: 0.06 m or more between wall and body's centre, not 0.05 m"
        ),
    ),
    "carried onto a box": (
        three(
            world="{boxes: [{center: [5, 5.2], size: [0.3, 0.3]}]}",
            disturbances="{kidnappings: [{" + CARRY + "}]}",
        ),
        (
            "x.yaml:11: disturbances.kidnappings.0.to: puts robot 1 onto box 0; "
            "allowed: 0.06 m or more between box and body's centre, not 0.05 m"
        ),
    ),
    "carried onto another": (
        happen("kidnappings", "robot: 1, time: 1, to: [1, 0], heading_deg: 90", "robot: 1, time: 5, to: [0, 0]"),
        (
            "disturbances.kidnappings.0.to: puts robot 1 onto robot 2's start, their bodies' centres 0 m apart; "
            "allowed: 0.12 m or more"
        ),
    ),
    "box in a robot": (
        three(world="{boxes: [{center: [1.3, 0], size: [0.4, 0.4], angle_deg: 45}]}"),
        (
            "world.boxes.0: stands in robot 2 at its start; "
            "allowed: 0.06 m or more between box and body's centre, not 0.0404 m"
        ),
    ),
    "box in a point robot": (
        ideal(world="{boxes: [{center: [1, 0], size: [0.4, 0.4]}]}"),
        "x.yaml:12: world.boxes.0: stands in robot 2 at its start; allowed: hand points off the boxes",
    ),
    "moving box in a robot": (
        three(world="{moving_boxes: [{size: [0.4, 0.4], waypoints: [{time: 3, center: [2, 0]}]}]}"),
        (
            "world.moving_boxes.0: stands in robot 3 at its start; "
            "allowed: 0.06 m or more between box and body's centre, not 0 m"
        ),
    ),
    "box without a size": (
        three(world="{boxes: [{center: [5, 5], size: [1.0e-9, 1]}]}"),
        "world.boxes.0.size: is [1e-09, 1.0]; allowed: at least 1e-06 m either way",
    ),
    "stops out of order": (
        three(
            world="{moving_boxes: [{size: [1, 1], waypoints: [{time: 3, center: [5, 5]}, {time: 3, center: [6, 6]}]}]}"
        ),
        "world.moving_boxes.0.waypoints.1.time: is 3.0 s; allowed: later than the one before, 3.0 s",
    ),
    "patch without area": (
        three(world="{patches: [{from: [0, 0], to: [1, 1]}, {from: [0, 3], to: [4, 3]}]}"),
        "world.patches.1: reaches from [0.0, 3.0] to [4.0, 3.0]; allowed: corners apart along x and along y",
    ),
    "camera ahead of its time": (
        three(sensors="{camera: {delay: -0.1}}"),
        "sensors.camera.delay: is -0.1; allowed: a number from 0 to 1e9",
    ),
    "camera far too late": (
        three(sensors="{camera: {delay: 11}}"),
        "sensors.camera.delay: is 11.0 s; allowed: at most 10.0 s",
    ),
    "radio ahead of its time": (
        three(radio="{delay: -1}"),
        "radio.delay: is -1; allowed: a number from 0 to 1e9",
    ),
    "radio far too late": (
        three(radio="{delay: 6, jitter: 5}"),
        "radio: has delay and jitter of 11.0 s; allowed: at most 10.0 s",
    ),
    "jitter in the ideal plant": (ideal(radio="{jitter: 0.1}"), f"x.yaml:12: radio.jitter: is 0.1, {NOTHING}"),
    "compensation beside a speed loop": (
        three(drive="{kind: speed_loop, friction_compensation: true}"),
        "drive.friction_compensation: is true; allowed: with `drive.kind: voltage` alone",
    ),
    "preset nobody knows": (
        three(sensors="{beams: {preset: sonar}}"),
        f"sensors.beams.preset: is 'sonar'; allowed: one of generic, {', '.join(PRESETS_IN_TURN)}",
    ),
    "preset against a key": (
        three(sensors="{beams: {preset: tof_ring, range_min: 3.5}}"),
        "sensors.beams: has range_min 3.5 m; allowed: less than range_max, 3.0 m",
    ),
    "beams below the axles": (
        three(sensors="{beams: {height: 0.0195}}"),
        f"sensors.beams.height: is 0.0195; allowed: {HEIGHTS}",
    ),
    "beams between tub and plate": (
        three(sensors="{beams: {height: 0.0425}}"),
        f"sensors.beams.height: is 0.0425; allowed: {HEIGHTS}",
    ),
    "beams above the plate": (
        three(sensors="{beams: {height: 0.054}}"),
        f"sensors.beams.height: is 0.054; allowed: {HEIGHTS}",
    ),
    "sweep of more than a turn": (
        three(sensors="{beams: {sweep_deg: 361}}"),
        "sensors.beams.sweep_deg: is 361; allowed: a number greater than 0 and at most 360",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_cannot_be_is_told(case: str) -> None:
    text, expected = WRONG[case]
    with pytest.raises(InputError) as caught:
        parse_scenario(text, "x.yaml")
    assert str(caught.value) == (expected if expected.startswith("x.yaml") else f"x.yaml:10: {expected}")


IGNORED = {
    "world.moving_boxes": "{moving_boxes: [{size: [1, 1], waypoints: [{time: 0, center: [1, 0]}]}]}",
    "world.floor_friction": "{floor_friction: 0.5}",
    "world.rolling_resistance": "{rolling_resistance: 0.1}",
    "world.patches": "{patches: [{from: [0, 0], to: [1, 1]}]}",
    "world.thresholds": "{thresholds: [{from: [0, 5], to: [1, 5], height: 0.002}]}",
    "world.ramps": "{ramps: [{from: [0, 5], to: [1, 5], width: 1, height: 0.05}]}",
    "sensors.camera.delay": "{camera: {delay: 0.1}}",
    "sensors.camera.lost_frames": "{camera: {lost_frames: 0.1}}",
    "sensors.camera.occlusions": "{camera: {occlusions: [{robot: 1, time: 1, duration: 1}]}}",
    "sensors.camera.swaps": "{camera: {swaps: [{robots: [1, 2], time: 1, duration: 1}]}}",
    "sensors.uwb.anchors": "{uwb: {anchors: [[0, 0], [1, 0], [0, 1]]}}",
    "sensors.odometry.fuse": "{odometry: {fuse: true}}",
    "drive.kind": "{kind: speed_loop}",
    "drive.pwm_levels": "{pwm_levels: 255}",
    "drive.friction": "{friction: 0}",
    "drive.friction_compensation": "{friction_compensation: true}",
    "radio.delay": "{delay: 0.1}",
    "radio.jitter": "{jitter: 0.1}",
    "disturbances.pushes": "{pushes: [{robot: 1, time: 0, duration: 1, force: [1, 0]}]}",
    "disturbances.dead_motors": "{dead_motors: [{robot: 1, side: left, time: 0}]}",
    "disturbances.kidnappings": "{kidnappings: [{robot: 1, time: 0, to: [1, 0]}]}",
}


@pytest.mark.parametrize("key", IGNORED)
def test_the_ideal_plant_refuses_what_it_would_ignore(key: str) -> None:
    section = key.split(".")[0]
    with pytest.raises(InputError, match=NOTHING) as caught:
        parse_scenario(ideal(**{section: IGNORED[key]}), "x.yaml")
    assert str(caught.value).startswith(f"x.yaml:12: {key}: is ")
    parse_scenario(
        three(**{section: IGNORED[key].replace("center: [1, 0]", "center: [7, 7]").replace("to: [1, 0]", "to: [7, 7]")})
    )


def test_every_such_key_is_tried_above() -> None:
    variations = {f"team.variation.{name}" for name in Variation.model_fields}  # tests/test_world_variation.py
    assert {".".join(path) for path in PHYSICS_ONLY} == {*IGNORED, *variations}


def test_defaults_may_be_spelt_out_in_the_ideal_plant() -> None:
    parse_scenario(
        ideal(
            drive="{kind: voltage, pwm_levels: 0, friction: 1}",
            radio="{delay: 0, jitter: 0}",
            disturbances="{pushes: []}",
            world="{floor_friction: 1, boxes: [{center: [7, 7], size: [1, 1]}]}",
            sensors="{camera: {delay: 0}}",
        )
    )


FITTING = {
    "put down where it was": happen("kidnappings", "robot: 2, time: 1, to: [1, 0], heading_deg: 90"),
    "again as soon as it is down": happen("kidnappings", f"{CARRY}, duration: 2", "robot: 1, time: 3, to: [6, 6]"),
    "box just off the body": three(world="{boxes: [{center: [1, 0.2001], size: [1, 0.2]}]}").replace("90", "270"),
    "beams as low as axles": three(sensors="{beams: {height: 0.02}}"),
    "beams as high as wheels": three(sensors="{beams: {height: 0.04, range_min: 0}}"),
    "one beam and a sweep": three(sensors="{beams: {count: 1, sweep_deg: 10}}"),
    "a moving box that will come": three(
        world="{moving_boxes: [{size: [1, 1], waypoints: [{time: 1, center: [9, 9]}, {time: 2, center: [1, 0]}]}]}"
    ),
}


@pytest.mark.parametrize("case", FITTING)
def test_what_can_be_passes(case: str) -> None:
    parse_scenario(FITTING[case])


def test_a_box_is_the_wall_along_its_length() -> None:
    wall = Box(center=(1, 2), size=(4, 0.5), angle_deg=90, height=0.3).as_wall()
    assert [x for end in (wall.start, wall.end) for x in end] == pytest.approx([1, 0, 1, 4], abs=1e-12)
    assert (wall.thickness, wall.height) == (0.5, 0.3)
