import mujoco
import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.schema import whole_number
from pbrg_mj.world.plant.build import build_plant
from pbrg_mj.world.plant.compose import compose, model_xml
from pbrg_mj.world.plant.ideal import IdealPlant
from pbrg_mj.world.plant.physics import MujocoPlant
from pbrg_mj.world.scene.robot import load_robot_model
from tests.worlds import scenario, wall

ROBOT = load_robot_model()
WALLS = (wall((1.1, -1 / 3), (0.7, 1.234567890123)),)


@pytest.mark.parametrize("robots", [1, 3, 12])
def test_any_number_of_robots_starts_with_hand_points_in_place(robots):
    headings = tuple(np.linspace(-170, 170, robots))
    world = MujocoPlant(scenario(robots, team={"heading_deg": headings}))
    np.testing.assert_allclose(world.truth().hand_world, [(0.5 * j, 0) for j in range(robots)], atol=1e-12)
    np.testing.assert_allclose(np.rad2deg(world.truth().body_pose[:, 2]), headings, atol=1e-9)
    np.testing.assert_allclose(world.observe().body_pose, world.truth().body_pose, atol=1e-12)


def test_saved_xml_compiles_to_the_same_trajectory_bit_for_bit():
    spec = compose(scenario(3, walls=WALLS, beams="all", team={"heading_deg": 100 / 7}), ROBOT)
    models = [spec.compile(), mujoco.MjModel.from_xml_string(model_xml(spec))]
    states = []
    for model in models:
        data, rng, seen = mujoco.MjData(model), np.random.default_rng(3), []
        for _ in range(100):
            data.ctrl[:] = rng.uniform(-6, 6, model.nu)
            mujoco.mj_step(model, data, nstep=5)
            seen.append(np.concatenate([data.qpos, data.qvel, data.act, data.sensordata]))
        states.append(np.array(seen))
    assert states[0].tobytes() == states[1].tobytes()


def test_two_runs_are_bit_identical():
    runs = []
    for _ in range(2):
        world, rng, seen = MujocoPlant(scenario(2, walls=WALLS, beams="all")), np.random.default_rng(4), []
        for _ in range(100):
            world.advance(rng.uniform(-6, 6, (2, 2)))
            truth, readings = world.truth(), world.observe()
            seen += [truth.body_pose, truth.wheel_speed, readings.body_pose, readings.ranges]
        runs.append(b"".join(a.tobytes() for a in seen))
    assert runs[0] == runs[1]


def test_the_floor_rules_the_wheels_and_casters_have_no_friction():
    for mu in (0.02, 0.7):
        world = MujocoPlant(scenario(world={"floor_friction": mu}))
        for _ in range(50):
            world.advance(np.zeros((1, 2)))
        contacts = {
            world.model.geom(int(max(c.geom))).name.split("/")[1].split("_")[0]: (c.dim, c.friction[0])
            for c in world.data.contact
        }
        assert contacts.pop("caster")[0] == 1
        assert contacts == {"tyre": (3, mu)}


def test_every_part_lies_within_the_body_radius():
    """The smallest disc: no point of any geom that can touch lies beyond it at any height."""
    model = MujocoPlant(scenario()).model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    axle = data.body("robot0/robot").xpos
    for k in range(model.ngeom):
        if model.geom_bodyid[k] == 0:
            continue
        low, high = model.geom_aabb[k, :3] - model.geom_aabb[k, 3:], model.geom_aabb[k, :3] + model.geom_aabb[k, 3:]
        corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
        if model.geom(k).name.endswith(("tub", "bumper", "skirt", "mark_centre")):
            assert model.geom_size[k, 0] <= ROBOT.body_radius
        else:
            placed = corners @ data.geom_xmat[k].reshape(3, 3).T + data.geom_xpos[k] - axle
            assert np.hypot(placed[:, 0], placed[:, 1]).max() <= ROBOT.body_radius


def test_whole_number_refuses_what_does_not_fit():
    assert whole_number(0.01, 0.002) == 5
    assert whole_number(0.3, 0.1) == 3
    for tick, step in ((0.01, 0.003), (0.001, 0.002)):
        with pytest.raises(ValueError, match="whole number"):
            whole_number(tick, step)


def test_the_scenario_names_the_plant():
    assert isinstance(build_plant(scenario()), MujocoPlant)
    assert isinstance(build_plant(scenario(plant="ideal")), IdealPlant)


def test_the_ideal_plant_integrates_exactly_and_is_seen_exactly():
    world = IdealPlant(scenario(2, walls=(wall((2, -1), (2, 1)),), plant="ideal"))
    u = np.array([[0.5, -0.25], [1.0, 0.0]])
    for _ in range(100):
        world.advance(u)
    truth, seen = world.truth(), world.observe()
    np.testing.assert_allclose(truth.hand_world, [[0.5, -0.25], [1.5, 0.0]], atol=1e-12)
    np.testing.assert_allclose(truth.body_pose, [[0.46, -0.25, 0], [1.46, 0, 0]], atol=1e-12)
    np.testing.assert_array_equal(seen.body_pose, truth.body_pose)
    np.testing.assert_allclose(truth.wall_margin, [1.95 - 0.5 - 0.1, 1.95 - 1.5 - 0.1], atol=1e-12)
    assert (seen.pose_frame, seen.scan_frame, seen.ranges.shape) == (100, -1, (0, 72))
    assert not truth.wall_contact.any()
    for _ in range(50):
        world.advance(u)
    np.testing.assert_array_equal(world.truth().wall_contact, [False, True])


def test_what_mujoco_refuses_is_one_line():
    """Sizes so far apart that MuJoCo's inertia of a box breaks the triangle inequality by rounding."""
    huge = {
        "start": (-75791.66280107816, 50.01903835011408),
        "end": (75791.66280107816, 50.748534911098076),
        "thickness": 0.01903835011408123,
        "height": 109726455.41618064,
    }
    with pytest.raises(InputError, match=r"^world: is refused by MuJoCo: .*inertia") as caught:
        compose(scenario(1, walls=(huge,)), ROBOT)
    assert "\n" not in str(caught.value)
