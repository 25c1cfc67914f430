"""BatchSimulation side by side are the runs of their seeds, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.loop.batch import BatchSimulation, side_by_side
from pbrg_mj.loop.sequential import run_world
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario

SEEDS = (3, 1, 2**40)
FIRST = ("timing.duration=1.0", "reference.solver=none")
NEAR_WALLS = "team.start=[[0.3,2.2],[0.2,0.3],[1.2,0.2],[2.2,0.2],[1.2,1.2]]"
LATER = {  # seen walls, events within ticks, remedies: whatever a world can differ in
    "walls": ("sensors.beams.robots=all", NEAR_WALLS),
    "late camera": ("sensors.camera.delay=0.05",),
    "leak, duty cycles, cap": ("control.leak=0.5", "drive.pwm_levels=255", "governor.multiplier_cap=0.3"),
    "proximal rounds": ("governor.integration=proximal", "governor.rounds=1"),
    "friction compensation": ("drive.friction_compensation=true",),
    "push and dead motor": (
        "disturbances.pushes=[{time: 0.303, duration: 0.2, robot: 2, force: [2.0, -1.0]}]",
        "disturbances.dead_motors=[{time: 0.4, duration: 0.5, robot: 5, side: right}]",
    ),
    "diverging": ("governor.step=0.5",),
}


@pytest.mark.parametrize("name", LATER)
def test_every_world_is_the_run_of_its_seed(name):
    scenario = load_scenario("paper/experiment_near", [*FIRST, *LATER[name]]).scenario
    histories = BatchSimulation(scenario, SEEDS, threads=2).run()
    for world, seed in enumerate(SEEDS):
        alone = [*Simulation.build(scenario.model_copy(update={"seed": seed})).records()]
        assert histories.time.tolist() == [record.time for record in alone]
        for tick, record in enumerate(alone):
            assert histories.hand_world[world, tick].tobytes() == record.truth.hand_world.tobytes()
            assert histories.m[world, tick].tobytes() == record.solution.m.tobytes()
            assert histories.wall_margin[world, tick].tobytes() == record.truth.wall_margin.tobytes()
            assert histories.wall_contact[world, tick].tobytes() == record.truth.wall_contact.tobytes()
            assert histories.diverged[world, tick] == (record.solution.status == "diverged")
            if name != "diverging":
                assert histories.certificate_violated[world, tick, 0] == (record.operation.worst_row > 1e-6)
    assert histories.diverged.any() == (name == "diverging")
    assert not np.array_equal(histories.hand_world[0], histories.hand_world[1])


CONTRADICT = "estimator.given=[{robot: 1, normal: [1, 0], offset: -1.5}, {robot: 2, normal: [-1, 0], offset: 1.4}]"
CERTIFIED = {
    "beams": ("governor.kind=certified", NEAR_WALLS),
    "recommended": ("set_up=recommended", NEAR_WALLS, "drive.friction_compensation=true"),
    "no distances kept": ("governor.kind=certified", "control.separation=null", "sensors.camera.delay=0.05"),
    "rows that contradict each other": ("governor.kind=certified", "estimator.source=given", CONTRADICT),
    "the paper's flow, points, distances kept": ("estimator.source=points", NEAR_WALLS, "control.separation=0.9"),
}


@pytest.mark.parametrize("name", CERTIFIED)
def test_worlds_with_certified_governors_points_and_distances_are_those_one_by_one(name):
    changes = ("timing.duration=0.7", "sensors.beams.robots=all", *CERTIFIED[name])
    scenario = load_scenario("paper/experiment_near", changes).scenario
    assert side_by_side(scenario)
    histories = BatchSimulation(scenario, (8, 5), threads=2).run()
    assert not np.array_equal(histories.hand_world[0], histories.hand_world[1])
    for world, seed in enumerate((8, 5)):
        alone = run_world(scenario.model_copy(update={"seed": seed}))
        for name in ("hand_world", "m", "wall_margin", "robot_contact", "diverged", "certificate_violated"):
            assert getattr(histories, name)[world].tobytes() == getattr(alone, name)[0].tobytes(), name


def test_threads_change_nothing_and_every_tick_is_reported_once():
    scenario = load_scenario("paper/experiment_near", [*FIRST, "timing.duration=0.3"]).scenario
    heard = []
    one, three = (
        BatchSimulation(scenario, range(5), threads=1).run(heard.append),
        BatchSimulation(scenario, range(5), threads=3).run(),
    )
    assert [tick for ticks in heard for tick in ticks] == list(range(31))
    assert one.hand_world.tobytes() == three.hand_world.tobytes()
    assert one.m.tobytes() == three.m.tobytes()


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        (("drive.kind=speed_loop",), "drive.kind"),
        (("radio.delay=0.02",), "radio"),
        (("governor.kind=centralized",), "governor"),
        (("governor.backend=numpy",), "governor"),
        (("network.delay_rounds=5",), "governor"),
        (("governor.kind=certified", "governor.certificate=directional_ball"), "governor"),
        (("governor.kind=cbf",), "governor"),
        (("disturbances.kidnappings=[{time: 1, duration: 1, robot: 1, to: [0, 0]}]",), "disturbances.kidnappings"),
    ],
)
def test_what_a_batch_does_not_offer_is_refused_by_name(changes, key):
    with pytest.raises(InputError, match="one by one") as refused:
        BatchSimulation(load_scenario("paper/experiment_near", changes).scenario, (1, 2))
    assert refused.value.key == key


def test_the_ideal_plant_and_no_seeds_are_refused():
    ideal, physics = (load_scenario(f"paper/{name}").scenario for name in ("simulation_near", "experiment_near"))
    with pytest.raises(InputError, match="one by one"):
        BatchSimulation(ideal, (1, 2))
    with pytest.raises(InputError, match="no seeds"):
        BatchSimulation(physics, ())
