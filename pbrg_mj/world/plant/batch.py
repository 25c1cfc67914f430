"""Many worlds of one scenario, stepped in a batch by mujoco.batch."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco
import numpy as np
from mujoco import batch

from pbrg_mj.errors import InputError
from pbrg_mj.kernel import kernel
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.actuation.disturbances import Disturbances
from pbrg_mj.world.actuation.motor_driver import over_first_step
from pbrg_mj.world.physics_steps import steps_per_tick
from pbrg_mj.world.plant.compose import compose
from pbrg_mj.world.plant.interface import Observation, Truth
from pbrg_mj.world.plant.truth import (
    MujocoArrays,
    TruthIndex,
    empty_truth,
    mujoco_arrays,
    truth_index,
    write_truth,
)
from pbrg_mj.world.scene.footprints import Footprints, world_footprints
from pbrg_mj.world.scene.model_index import index_model, motor_inputs
from pbrg_mj.world.scene.obstacles import moving_footprints
from pbrg_mj.world.scene.robot import load_robot_model
from pbrg_mj.world.sensors.beams import scan_frame
from pbrg_mj.world.sensors.camera import camera_poses, fill_camera_history
from pbrg_mj.world.sensors.sampling import Sampler
from pbrg_mj.world.sensors.surfaces import Surfaces


class PlantBatch:
    """W copies of a scenario's physics at the same time, each bit for bit the same as MujocoPlant.

    All worlds have the same model and the same clock; pushes and dead motors are the same in all of them.
    """

    def __init__(self, scenario: Scenario, worlds: int, threads: int):
        """Compose the model once. Raises InputError for what cannot be stepped in a batch."""
        check_batchable(scenario)
        timing, camera, beams = scenario.timing, scenario.sensors.camera, scenario.sensors.beams
        self._robot = load_robot_model(scenario.robot)
        self._steps_per_tick = steps_per_tick(timing)
        model = compose(scenario, self._robot).compile()
        self._index = index_model(model, scenario, self._robot)
        self._camera = Sampler(camera.rate_hz, timing.physics_step, camera.delay)
        self._beam_section = beams
        self._beams = Sampler(beams.rate_hz, timing.physics_step)
        self._surfaces = Surfaces(scenario)
        self._disturbances = Disturbances(scenario)
        self._step = 0
        self._batch = batch.Batch(model, worlds, threads, persistent=True)
        self._arrays = mujoco_arrays(self._batch.bind, omnidirectional=False)
        self._truth_from = (
            tuple(self._arrays),
            tuple(truth_index(self._index)),
            (tuple(world_footprints(scenario.world)), tuple(moving_footprints((), 0.0))),
            (self._robot.clearance, self._robot.body_radius),
            tuple(empty_truth(scenario.robots)),
        )
        self._motors = motor_inputs(self._batch.bind("ctrl"), self._index.motor)
        self._push = self._batch.bind("xfrc_applied")
        if self._camera.delay_steps:
            data = mujoco.MjData(model)
            fill_camera_history(model, data, scenario.robots, self._camera)
            self._batch.bind("history")[:] = data.history
        self._batch.forward(stage=mujoco.mjtStage.mjSTAGE_VEL)

    def frames(self) -> tuple[int, int]:
        """Return the numbers of the camera's and the beams' frames that are held now; -1: no beams."""
        scan = scan_frame(self._beam_section, self._beams, self._step) if len(self._index.beams) else -1
        return self._camera.frame(self._step), scan

    def observe(self) -> list[Observation]:
        """Return each world's last samples."""
        pose_frame, scan = self.frames()
        readings, index = self._arrays.sensordata, self._index
        poses = camera_poses(readings, index.camera_position, index.camera_ahead)
        ranges, met = readings[:, index.beams], [self._surfaces.hit_properties(row, index.beams) for row in readings]
        return [Observation(pose, pose_frame, ranges[w], scan, **met[w]) for w, pose in enumerate(poses)]

    def truth(
        self, hand_world: np.ndarray, wall_margin: np.ndarray, wall_contact: np.ndarray, robot_contact: np.ndarray
    ) -> None:
        """Write the true hand points (W, n, 2) [m], margins (W, n) [m] and contacts (W, n) into these arrays."""
        _write_truths(*self._truth_from, (hand_world, wall_margin, wall_contact, robot_contact))

    def advance(self, voltage: np.ndarray) -> None:
        """Hold voltages (W, n, 2) left, right [V] over one tick."""
        last = self._step + self._steps_per_tick
        while self._step < last:
            after = self._disturbances.without_dead_motors(voltage, self._step)
            if self._disturbances.pushing:
                self._push[:, self._index.body, :2] = self._disturbances.force(self._step)
            steps = min(last, self._disturbances.next_change(self._step)) - self._step
            self._hold(over_first_step(self._motors, after), 1)
            self._hold(after, steps - 1)
            self._step += steps

    def _hold(self, voltage: np.ndarray, steps: int) -> None:
        if steps:
            self._motors[:] = voltage
            self._batch.step(nstep=steps, stage=mujoco.mjtStage.mjSTAGE_VEL)


def is_batchable(scenario: Scenario) -> bool:
    """Return whether the plant needs nothing but MuJoCo within a tick, and one model for all worlds."""
    return _unsupported(scenario) is None


def check_batchable(scenario: Scenario) -> None:
    """Raise InputError for a scenario that is not `is_batchable`."""
    if key := _unsupported(scenario):
        raise InputError("a batch of worlds does not support this; run the seeds one by one", key=key)


def _unsupported(scenario: Scenario) -> str | None:
    """Return the key of what no batch can step."""
    unsupported = {
        "plant": scenario.plant != "physics",
        "robot": load_robot_model(scenario.robot).omnidirectional,
        "sensors.odometry.fuse": scenario.sensors.odometry.fuse,
        "drive.kind": scenario.drive.kind != "voltage",
        "radio": bool(scenario.radio.delay or scenario.radio.jitter),
        "world.patches": bool(scenario.world.patches),
        "world.moving_boxes": bool(scenario.world.moving_boxes),
        "disturbances.kidnappings": bool(scenario.disturbances.kidnappings),
    }
    return next((key for key, given in unsupported.items() if given), None)


@kernel
def _write_truths(arrays, index, obstacles, size, blank, truths):
    """Write hand points, margins and contacts of every world w; `arrays` are MujocoArrays of all worlds.

    `obstacles` are the members of Footprints of walls and of moving boxes, `truths` hand_world (W, n, 2) [m], margins
    (W, n) [m], touched_walls (W, n), touched_robots (W, n) bool. What is not asked for goes into the arrays of `blank`,
    a Truth.
    """
    arrays, index, blank = MujocoArrays(*arrays), TruthIndex(*index), Truth(*blank)
    walls, moving = obstacles
    obstacles = (Footprints(*walls), Footprints(*moving))
    hand_world, margins, touched_walls, touched_robots = truths
    for w in range(len(hand_world)):
        places = arrays.xpos[w], arrays.xmat[w], arrays.site_xpos[w]
        one = MujocoArrays(*places, arrays.speed[w], arrays.sensordata[w], arrays.history[w])
        truth = Truth(
            blank.body_pose,
            hand_world[w],
            blank.wheel_speed,
            margins[w],
            touched_walls[w],
            blank.moving_margin,
            blank.moving_contact,
            touched_robots[w],
        )
        write_truth(one, index, obstacles, size, truth)
