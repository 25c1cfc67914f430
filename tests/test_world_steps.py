"""Physics steps that need no asking run in one go; what happened in them is seen all the same."""

import numpy as np
import pytest

from pbrg_mj.world.plant.physics import MujocoPlant
from tests.worlds import scenario, wall

EVENTS = {
    "nothing": {},
    "late radio": {"radio": {"delay": 0.013, "jitter": 0.02}},
    "push": {"disturbances": {"pushes": [{"time": 0.033, "duration": 0.05, "robot": 1, "force": [3.0, 1.0]}]}},
    "dead motor": {"disturbances": {"dead_motors": [{"time": 0.025, "duration": 0.1, "robot": 1, "side": "left"}]}},
}


@pytest.mark.parametrize("name", EVENTS)
def test_steps_in_one_go_are_steps_one_by_one_bit_for_bit(name, monkeypatch):
    at_once, one_by_one = MujocoPlant(scenario(2, **EVENTS[name])), MujocoPlant(scenario(2, **EVENTS[name]))
    monkeypatch.setattr(one_by_one, "_stepwise", True)
    rng = np.random.default_rng(1)
    for _ in range(40):
        command = rng.uniform(-6, 6, (2, 2))
        at_once.advance(command)
        one_by_one.advance(command)
        assert at_once.data.qpos.tobytes() == one_by_one.data.qpos.tobytes()
        assert at_once.data.sensordata.tobytes() == one_by_one.data.sensordata.tobytes()
        assert at_once.truth().body_pose.tobytes() == one_by_one.truth().body_pose.tobytes()


def wall_pairs(world: MujocoPlant) -> bool:
    """Return whether MuJoCo lists a contact between robot 0 and a wall now."""
    model = world.model
    of_geom = [model.body_rootid[body] for body in model.geom_bodyid]
    robot, walls = model.body("robot0/robot").id, model.body("walls").id
    pairs = [{of_geom[a], model.geom_bodyid[b]} for a, b in world.data.contact.geom]
    pairs += [{of_geom[b], model.geom_bodyid[a]} for a, b in world.data.contact.geom]
    return {robot, walls} in pairs


@pytest.mark.parametrize("steps", [1, 5])
def test_a_contact_in_any_step_of_a_tick_is_a_contact_of_the_tick(steps):
    """The robot drives into a wall and bounces; another world, asked after every step, is the witness."""
    timing = {"tick": 0.002 * steps, "physics_step": 0.002}
    obstacles = {"world": {"walls": [wall([0.35, -1.0], [0.35, 1.0])]}}
    world = MujocoPlant(scenario(timing=timing, **obstacles))
    witness = MujocoPlant(scenario(timing={"tick": 0.002, "physics_step": 0.002}, **obstacles))
    rng, seen = np.random.default_rng(2), []
    for tick in range(800 // steps):
        command = np.full((1, 2), 6.0) if tick < 500 // steps else rng.uniform(-6, 6, (1, 2))
        world.advance(command)
        touched = False
        for _ in range(steps):
            witness.advance(command)
            touched |= wall_pairs(witness)
        assert bool(world.truth().wall_contact[0]) == touched
        seen.append(touched)
    assert 5 < sum(seen) < len(seen) - 5
