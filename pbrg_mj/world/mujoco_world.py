"""The physics plant: robots, motors, friction, obstacles, beams, camera, radio and disturbances in MuJoCo."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco
import numpy as np

from pbrg_mj.scenario.checks import whole_number
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.camera import remember_start
from pbrg_mj.world.carries import Carries
from pbrg_mj.world.compose import compose, model_xml, start_pose
from pbrg_mj.world.disturbances import Disturbances
from pbrg_mj.world.geometry import wall_margin, wall_rectangles
from pbrg_mj.world.interface import Observation, Truth
from pbrg_mj.world.model_index import index_model
from pbrg_mj.world.obstacles import box_centre
from pbrg_mj.world.patches import Patches
from pbrg_mj.world.radio import RadioLink
from pbrg_mj.world.robot import load_robot_model
from pbrg_mj.world.sampling import Sampler
from pbrg_mj.world.speed_loop import speed_loop


class MujocoWorld:
    """The scenario in physics.

    Commands (n, 2) left, right are wheel voltages [V], clipped to the motors' range, or with `drive.kind: speed_loop`
    wheel speeds [rad/s]. They act when the radio has brought them.
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
        self._camera = Sampler(sensors.camera.rate_hz, timing.physics_step, sensors.camera.delay)
        self._beams = Sampler(sensors.beams.rate_hz, timing.physics_step)
        self._walls = wall_rectangles(scenario.world.obstacles)
        self._moving_boxes = scenario.world.moving_boxes
        self._patches = Patches(scenario, self.robot, self.model) if scenario.world.patches else None
        drive = scenario.drive
        looped = drive.kind == "speed_loop"
        self._speed_loop = speed_loop(self.robot, timing.physics_step, drive.pwm_levels) if looped else None
        self._wound = np.zeros((scenario.robots, 2))  # the speed loops' integral parts [V]
        self._radio = RadioLink(scenario)
        self._disturbances = Disturbances(scenario)
        carried = bool(scenario.disturbances.carries)
        self._carries = Carries(scenario, self.robot, start_pose(scenario, self.robot)) if carried else None
        self._step = 0
        self._touched = np.zeros(scenario.robots, dtype=bool)
        if self._camera.delay_steps:
            remember_start(self.model, self.data, scenario.robots, self._camera)
        self._begin_step()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._step * self.model.opt.timestep

    def observe(self) -> Observation:
        """Return the camera's and the beams' last samples."""
        readings, index = self.data.sensordata, self._index
        body_pose = _poses(readings[index.camera_position], readings[index.camera_ahead])
        pose_frame = self._camera.frame(self._step)
        if self._carries:
            body_pose = self._carries.camera(body_pose, self._camera.step(pose_frame))
        scan_frame = self._beams.frame(self._step) if len(index.beams) else -1
        return Observation(body_pose, pose_frame, readings[index.beams], scan_frame)

    def truth(self) -> Truth:
        """Return poses, wheel speeds and wall contacts as they are."""
        data, index = self.data, self._index
        hand_world = data.site_xpos[index.hand, :2]
        return Truth(
            body_pose=self._body_pose(),
            hand_world=hand_world,
            wheel_speed=data.qvel[index.wheel_speed],
            wall_margin=wall_margin(hand_world, self._walls, self.robot.clearance),
            wall_contact=self._touched.copy(),
        )

    def advance(self, command: np.ndarray) -> None:
        """Send `command` (n, 2) left, right [V], or [rad/s] with the speed loop, and let one tick pass.

        A tick starts and ends after the first half of a physics step (positions, contacts, sensors), so that readings
        are those of the tick's very start, and the command acts from the second half on.
        """
        self._radio.send(command, self._step)
        if self._patches:
            self._patches.meet(self.data)
        self._touched[:] = False
        for _ in range(self.steps_per_tick):
            self._end_step()
            self._step += 1
            self._begin_step()

    def _begin_step(self) -> None:
        """Move what does not move by forces, then work out positions, contacts and sensors."""
        for k, box in enumerate(self._moving_boxes):
            self.data.mocap_pos[k, :2] = box_centre(box, self.time)
        if self._carries:
            self._carries.place(self.model, self.data, self._index, self._step)
            self._wound[self._carries.aloft(self._step)] = 0.0
        mujoco.mj_step1(self.model, self.data)
        if self._carries and self._camera.step(self._camera.newest(self._step)) == self._step:
            self._carries.watch(self._body_pose(), self._step)
        self._note_wall_contacts()

    def _end_step(self) -> None:
        """Let motors and pushes act over the physics step."""
        voltage = self._radio.received(self._step)
        if self._speed_loop:
            speed = self.data.qvel[self._index.wheel_speed]
            voltage, self._wound = self._speed_loop.voltage(voltage, speed, self._wound)
        self.data.ctrl[self._index.motor] = self._disturbances.deaden(voltage, self._step)
        if self._disturbances.pushing:
            self.data.xfrc_applied[self._index.body, :2] = self._disturbances.force(self._step)
        mujoco.mj_step2(self.model, self.data)

    def _body_pose(self) -> np.ndarray:
        data, index = self.data, self._index
        return _poses(data.xpos[index.body, :2], data.xmat[index.body][:, [0, 3]])  # x and y of the body's x axis

    def _note_wall_contacts(self) -> None:
        geoms = self.data.contact.geom  # (contacts, 2)
        wall = self._index.wall_geom[geoms]
        if wall.any():
            self._touched |= self._index.robot_geom[geoms[wall.any(axis=1)]].any(axis=(0, 1))


def _poses(position: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Return poses (n, 3) from places (n, 2) and horizontal parts (n, 2) of the bodies' x axes."""
    return np.column_stack([position, np.arctan2(ahead[:, 1], ahead[:, 0])])
