"""Contacts with walls, moving boxes and robots are sensed at every physics step, and told apart."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.plant.batch import PlantBatch
from pbrg_mj.world.plant.ideal import IdealPlant
from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.obstacles import box_centre
from pbrg_mj.world.scene.robot import load_robot_model
from tests.worlds import scenario, wall

ROBOT = load_robot_model()
KINDS = ("wall_contact", "moving_contact", "robot_contact")


def crowded(steps: int) -> Scenario:
    """Three robots in a row between two walls, and a box that drives to and fro through the team."""
    stops = [{"time": 0.5 * k, "center": (0.3, -0.4 if k % 2 else 0.4)} for k in range(8)]
    still = [{"time": 0.0, "center": (0.25, -0.8)}]
    around = {
        "walls": [wall((-0.2, -1), (-0.2, 1)), wall((0.65, -1), (0.65, 1))],
        "moving_boxes": [{"size": (0.1, 0.2), "waypoints": stops}, {"size": (0.2, 0.1), "waypoints": still}],
    }
    team = {"start": [(0.0, 0.0), (0.15, 0.0), (0.4, 0.0)]}
    return scenario(3, team=team, timing={"tick": 0.002 * steps, "physics_step": 0.002}, world=around)


def touching(world: MujocoPlant) -> np.ndarray:
    """Return from MuJoCo's own list of contacts, (3, n): with walls, with moving boxes, with other robots."""
    model, n = world.model, len(world.truth().wall_contact)
    robots = {model.body(f"robot{j}/robot").id: j for j in range(n)}
    found = np.zeros((3, n), dtype=bool)
    for pair in world.data.contact.geom:
        roots = [int(model.body_rootid[model.geom_bodyid[geom]]) for geom in pair]
        for mine, other in (roots, roots[::-1]):
            if mine in robots:
                name = model.body(other).name
                found[0, robots[mine]] |= name == "walls"
                found[1, robots[mine]] |= name.startswith("moving_box")
                found[2, robots[mine]] |= name.startswith("robot")
    return found


@pytest.mark.parametrize("steps", [1, 5])
def test_every_contact_of_every_step_is_the_tick_s(steps):
    """Another world, asked after every physics step for MuJoCo's own list, is the witness."""
    counts = np.zeros(3, dtype=int)
    for seed in (3, 4, 5):
        world, witness, rng = MujocoPlant(crowded(steps)), MujocoPlant(crowded(1)), np.random.default_rng(seed)
        for tick in range(600 // steps):
            if tick % (50 // steps) == 0:
                command = np.tile(rng.uniform(-6, 6, (3, 1)), 2) + rng.uniform(-2, 2, (3, 2))
            world.advance(command)
            expected = np.zeros((3, 3), dtype=bool)
            for _ in range(steps):
                witness.advance(command)
                expected |= touching(witness)
            truth = world.truth()
            np.testing.assert_array_equal([getattr(truth, kind) for kind in KINDS], expected)
            counts += expected.any(axis=1)
    assert counts.min() > 5  # there were contacts of every kind


def test_a_robot_between_a_wall_and_a_robot_touches_both():
    plan = scenario(2, team={"start": [(0.0, 0.0), (0.13, 0.0)]}, walls=(wall((0.26, -1), (0.26, 1)),))
    world = MujocoPlant(plan)
    for _ in range(100):
        world.advance(np.full((2, 2), 3.0))
    truth = world.truth()
    assert truth.wall_contact.tolist() == [False, True]
    assert truth.robot_contact.tolist() == [True, True]
    assert not truth.moving_contact.any()


def test_a_robot_that_lies_on_its_side_touches_no_robot():
    world = MujocoPlant(scenario(2))
    place = world.model.joint("robot0/free").qposadr[0]
    world.data.qpos[place + 2 : place + 7] = [0.06, np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0]
    for _ in range(50):
        world.advance(np.zeros((2, 2)))
    floor = world.model.geom("floor").id
    skirt = world.model.geom("robot0/skirt").id
    assert any(set(pair) == {floor, skirt} for pair in world.data.contact.geom.tolist())
    assert not world.truth().robot_contact.any()


def test_margins_follow_a_moving_box():
    """Against the definition: the distance from the rectangle where the box is at the time, less the clearance."""
    plan = crowded(5)
    for world in (MujocoPlant(plan), IdealPlant(plan.model_copy(update={"plant": "ideal"}))):
        for _ in range(60):
            world.advance(np.zeros((3, 2)))
        truth = world.truth()
        boxes = plan.world.moving_boxes
        offsets = [np.abs(truth.hand_world - box_centre(box, world.time)) - np.array(box.size) / 2 for box in boxes]
        distances = [np.linalg.norm(np.maximum(offset, 0), axis=1) for offset in offsets]
        np.testing.assert_allclose(truth.moving_margin, np.min(distances, axis=0) - ROBOT.clearance, atol=1e-12)


def test_without_moving_boxes_their_margin_is_infinite():
    assert np.isinf(MujocoPlant(scenario(2)).truth().moving_margin).all()
    assert np.isinf(IdealPlant(scenario(2, plant="ideal")).truth().moving_margin).all()


def test_in_the_ideal_plant_distances_decide():
    stops = [{"time": 0.0, "center": (0.5, 0.5)}, {"time": 1.0, "center": (0.5, 0.0)}]
    plan = scenario(3, plant="ideal", world={"moving_boxes": [{"size": (0.2, 0.2), "waypoints": stops}]})
    world = IdealPlant(plan)
    assert not world.truth().moving_contact.any()
    for _ in range(100):
        world.advance(np.array([[0.0, 0.0], [0.0, 0.0], [-0.2, 0.0]]))  # robot 3 ends 0.3 m from robot 2
    truth = world.truth()
    assert truth.moving_contact.tolist() == [False, True, False]
    assert not truth.robot_contact.any()
    for gap, met in ((0.121, False), (0.119, True)):
        near = IdealPlant(scenario(3, plant="ideal", team={"start": [(0, 0), (0, gap), (2, 0)]}))
        assert near.truth().robot_contact.tolist() == [met, met, False]


def test_a_batch_senses_robots_that_meet():
    plan = scenario(2, team={"start": [(0.0, 0.0), (0.14, 0.0)]})
    batch, alone = PlantBatch(plan, 2, 1), MujocoPlant(plan)
    volts = np.array([[6.0, 6.0], [0.0, 0.0]])
    seen = []
    for _ in range(30):
        q, margin = np.empty((2, 2, 2)), np.empty((2, 2))
        walls, robots = np.empty((2, 2), dtype=bool), np.empty((2, 2), dtype=bool)
        batch.truth(q, margin, walls, robots)
        truth = alone.truth()
        for w in range(2):
            assert robots[w].tolist() == truth.robot_contact.tolist()
        assert not walls.any()
        seen.append(bool(robots.any()))
        batch.advance(np.stack([volts, volts]))
        alone.advance(volts)
    assert any(seen)
    assert not seen[0]


def test_the_counters_see_what_mujoco_lists():
    """`found` is the number of contacts, not a flag: the difference of two counters is a number of contacts."""
    plan = scenario(2, team={"start": [(0.0, 0.0), (0.12, 0.0)]}, walls=(wall((-0.15, -1), (-0.15, 1)),))
    world = MujocoPlant(plan)
    for _ in range(40):
        world.advance(np.array([[-6.0, -6.0], [-6.0, -6.0]]))
    model, skirt = world.model, world.model.geom("robot0/skirt").id
    listed = sum(skirt in pair for pair in world.data.contact.geom.tolist())
    counted = world.data.sensordata[model.sensor("robot0/skirt_contacts").adr[0]]
    assert counted == listed >= 2
