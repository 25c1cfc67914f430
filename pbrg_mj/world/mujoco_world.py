"""The physics plant: robots, motors, friction, walls, beams and camera in MuJoCo."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco
import numpy as np

from pbrg_mj.scenario.checks import whole_number
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.compose import compose, model_xml
from pbrg_mj.world.geometry import wall_margin, wall_rectangles
from pbrg_mj.world.interface import Observation, Truth
from pbrg_mj.world.model_index import index_model
from pbrg_mj.world.patches import Patches
from pbrg_mj.world.robot import load_robot_model
from pbrg_mj.world.sampling import Sampler
from pbrg_mj.world.speed_loop import speed_loop


class MujocoWorld:
    """The scenario in physics.

    Commands (n, 2) left, right are wheel voltages [V], clipped to the motors' range, or with `drive.kind: speed_loop`
    wheel speeds [rad/s].
    """

    def __init__(self, scenario: Scenario):
        """Compose the model and take the sensors' first samples. Raises ValueError when steps do not fit the tick."""
        timing = scenario.timing
        self.robot = load_robot_model()
        self.steps_per_tick = whole_number(timing.tick, timing.physics_step)
        spec = compose(scenario, self.robot)
        self.model_xml = model_xml(spec)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        sensors = scenario.sensors
        self._index = index_model(self.model, scenario.robots, scenario.beam_robots, sensors.beams.count)
        self._camera = Sampler(sensors.camera.rate_hz, timing.physics_step)
        self._beams = Sampler(sensors.beams.rate_hz, timing.physics_step)
        self._walls = wall_rectangles(scenario.world.walls)
        self._patches = Patches(scenario, self.robot, self.model) if scenario.world.patches else None
        drive = scenario.drive
        looped = drive.kind == "speed_loop"
        self._speed_loop = speed_loop(self.robot, timing.physics_step, drive.pwm_levels) if looped else None
        self._wound = np.zeros((scenario.robots, 2))  # the speed loops' integral parts [V]
        self._step = 0
        self._touched = np.zeros(scenario.robots, dtype=bool)
        mujoco.mj_step1(self.model, self.data)
        self._note_wall_contacts()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._step * self.model.opt.timestep

    def observe(self) -> Observation:
        """Return the camera's and the beams' last samples."""
        readings, index = self.data.sensordata, self._index
        ahead = readings[index.camera_ahead]
        heading = np.arctan2(ahead[:, 1], ahead[:, 0])
        return Observation(
            body_pose=np.column_stack([readings[index.camera_position], heading]),
            pose_frame=self._camera.frame(self._step),
            ranges=readings[index.beams],
            scan_frame=self._beams.frame(self._step) if len(index.beams) else -1,
        )

    def truth(self) -> Truth:
        """Return poses, wheel speeds and wall contacts as they are."""
        data, index = self.data, self._index
        ahead = data.xmat[index.body][:, [0, 3]]  # x and y of the body's x axis
        heading = np.arctan2(ahead[:, 1], ahead[:, 0])
        hand_world = data.site_xpos[index.hand, :2]
        return Truth(
            body_pose=np.column_stack([data.xpos[index.body, :2], heading]),
            hand_world=hand_world,
            wheel_speed=data.qvel[index.wheel_speed],
            wall_margin=wall_margin(hand_world, self._walls, self.robot.clearance),
            wall_contact=self._touched.copy(),
        )

    def advance(self, command: np.ndarray) -> None:
        """Hold `command` (n, 2) left, right [V], or [rad/s] with the speed loop, over one tick.

        A tick starts and ends after the first half of a physics step (positions, contacts, sensors), so that readings
        are those of the tick's very start, and the command acts from the second half on.
        """
        model, data = self.model, self.data
        if self._patches:
            self._patches.meet(data)
        if not self._speed_loop:
            data.ctrl[self._index.motor] = command
        self._touched[:] = False
        for _ in range(self.steps_per_tick):
            if self._speed_loop:
                speed = data.qvel[self._index.wheel_speed]
                data.ctrl[self._index.motor], self._wound = self._speed_loop.voltage(command, speed, self._wound)
            mujoco.mj_step2(model, data)
            mujoco.mj_step1(model, data)
            self._note_wall_contacts()
        self._step += self.steps_per_tick

    def _note_wall_contacts(self) -> None:
        geoms = self.data.contact.geom  # (contacts, 2)
        wall = self._index.wall_geom[geoms]
        if wall.any():
            self._touched |= self._index.robot_geom[geoms[wall.any(axis=1)]].any(axis=(0, 1))
