"""The physics plant: robots, motors, friction, obstacles, beams, camera, radio and disturbances in MuJoCo."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import mujoco
import numpy as np

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.actuation.disturbances import Disturbances
from pbrg_mj.world.actuation.friction import WheelFriction
from pbrg_mj.world.actuation.kidnapping import Kidnappings
from pbrg_mj.world.actuation.motor_driver import over_first_step
from pbrg_mj.world.actuation.radio import RadioLink
from pbrg_mj.world.actuation.speed_loop import speed_loop
from pbrg_mj.world.physics_steps import steps_per_tick
from pbrg_mj.world.plant.compose import compose, model_xml, start_pose
from pbrg_mj.world.plant.interface import Observation, Truth, TruthSample
from pbrg_mj.world.plant.mujoco_warnings import log_first_warning
from pbrg_mj.world.plant.truth import TruthSampler, body_poses, mujoco_arrays, truth_index
from pbrg_mj.world.scene.footprints import world_footprints
from pbrg_mj.world.scene.model_index import index_model, motor_inputs
from pbrg_mj.world.scene.obstacles import box_centre, moving_footprints
from pbrg_mj.world.scene.robot import load_robot_model
from pbrg_mj.world.sensors.beams import scan_frame
from pbrg_mj.world.sensors.camera import camera_poses, fill_camera_history
from pbrg_mj.world.sensors.sampling import Sampler
from pbrg_mj.world.sensors.surfaces import Surfaces


class MujocoPlant:
    """The scenario in physics.

    Commands (n, 2) left, right are wheel voltages [V], clipped to the motors' range, or with `drive.kind: speed_loop`
    wheel speeds [rad/s]. They act when the radio has brought them.
    """

    def __init__(self, scenario: Scenario):
        """Compose the model and take the sensors' first samples. Raises as `steps_per_tick`."""
        log_first_warning()
        timing = scenario.timing
        self.robot = load_robot_model(scenario.robot)
        self.steps_per_tick = steps_per_tick(timing)
        spec = compose(scenario, self.robot)
        self.model_xml = model_xml(spec)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        sensors = scenario.sensors
        self._index = index_model(self.model, scenario, self.robot)
        self._camera = Sampler(sensors.camera.rate_hz, timing.physics_step, sensors.camera.delay)
        self._beam_section, self._encoders = sensors.beams, sensors.odometry.fuse
        self._beams = Sampler(sensors.beams.rate_hz, timing.physics_step)
        self._surfaces = Surfaces(scenario)
        arrays = mujoco_arrays(partial(getattr, self.data), self.robot.omnidirectional)
        self._wheel_speed = arrays.speed
        walls, size = world_footprints(scenario.world), (self.robot.clearance, self.robot.body_radius)
        self._truth_sampler = TruthSampler(arrays, truth_index(self._index), walls, size)
        self._moving_boxes = scenario.world.moving_boxes
        self._wheel_friction = WheelFriction(scenario, self.robot, self.model) if scenario.world.patches else None
        drive = scenario.drive
        looped = drive.kind == "speed_loop"
        self._speed_loop = speed_loop(self.robot, timing.physics_step, drive.pwm_levels) if looped else None
        self._integral_voltage = np.zeros((scenario.robots, 2))  # of the speed loops [V]
        self._radio = RadioLink(scenario)
        self._disturbances = Disturbances(scenario)
        kidnapped = bool(scenario.disturbances.kidnappings)
        self._kidnappings = Kidnappings(scenario, self.robot, start_pose(scenario, self.robot)) if kidnapped else None
        self._stepwise = bool(looped or self._moving_boxes or self._kidnappings)
        self._step = 0
        self._motors = motor_inputs(self.data.ctrl, self._index.motor)
        self._voltage = np.zeros((scenario.robots, 2))  # what it holds between steps
        self._observed: Observation | None = None
        self._observed_until = 0  # the step at which a newer sample is there
        self._readings = self.data.sensordata[None]  # of one world
        if self._camera.delay_steps:
            fill_camera_history(self.model, self.data, scenario.robots, self._camera)
        self._begin_step()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._step * self.model.opt.timestep

    def observe(self) -> Observation:
        """Return the camera's and the beams' last samples; the same object while they are the last ones."""
        last = self._observed
        if last is None or self._step >= self._observed_until:
            self._observed = last = self._sample()
        return last._replace(time=self.time, wheel_angle=self._wheel_angle()) if self._encoders else last

    def _wheel_angle(self) -> np.ndarray:
        return self.data.qpos[self._index.wheel_angle]

    def truth(self) -> Truth:
        """Return poses, wheel speeds, margins and contacts as they are."""
        return self.truths([self.sample_truth()])[0]

    def sample_truth(self) -> TruthSample:
        """Return what the truth of now is made of."""
        return self.time, self._truth_sampler.sample()

    def truths(self, samples: Sequence[TruthSample]) -> list[Truth]:
        """Return the truth at each of one sample or more."""
        moving = [moving_footprints(self._moving_boxes, time) for time, _ in samples]
        return self._truth_sampler.truths([arrays for _, arrays in samples], moving)

    def advance(self, command: np.ndarray) -> None:
        """Send `command` (n, 2) left, right [V], or [rad/s] with the speed loop, and let one tick pass.

        A tick starts and ends after the first half of a physics step (positions, contacts, sensors), so that readings
        are those of the tick's very start, and the command acts from the second half on.
        """
        self._radio.send(command, self._step)
        if self._wheel_friction:
            self._wheel_friction.update(self.data)
        last = self._step + self.steps_per_tick
        while self._step < last:
            self._end_step()
            steady = min(last, self._next_change()) - 1 - self._step
            if steady > 0:
                mujoco.mj_step(self.model, self.data, steady)
            self._step += 1 + steady
            self._begin_step()

    def _next_change(self) -> int:
        """Return the first step after this one at which an input changes: until then MuJoCo steps on its own."""
        if self._stepwise:
            return self._step + 1
        return min(self._radio.next_arrival, self._disturbances.next_change(self._step))

    def _sample(self) -> Observation:
        pose_frame, scan = self._camera.frame(self._step), -1
        self._observed_until = self._camera.held_until(pose_frame)
        if len(self._index.beams):
            scan = scan_frame(self._beam_section, self._beams, self._step)
            self._observed_until = min(self._observed_until, self._beams.held_until(max(scan, 0)))
        readings, index = self.data.sensordata, self._index
        body_pose = camera_poses(self._readings, index.camera_position, index.camera_ahead)[0]
        if self._kidnappings:
            body_pose = self._kidnappings.camera_readings(body_pose, self._camera.step(pose_frame))
        last = self._observed
        if last and last.scan_frame == scan:
            return last._replace(body_pose=body_pose, pose_frame=pose_frame)
        met = self._surfaces.hit_properties(readings, index.beams)
        return Observation(body_pose, pose_frame, readings[index.beams], scan, **met)

    def _begin_step(self) -> None:
        """Move what forces do not move, then compute positions, contacts and sensors."""
        for k, box in enumerate(self._moving_boxes):
            self.data.mocap_pos[k, :2] = box_centre(box, self.time)
        if self._kidnappings:
            self._kidnappings.apply(self.model, self.data, self._index, self._step)
            self._integral_voltage[self._kidnappings.lifted(self._step)] = 0.0
        mujoco.mj_step1(self.model, self.data)
        if self._kidnappings and self._camera.step(self._camera.newest(self._step)) == self._step:
            self._kidnappings.record_frame(body_poses(self.data.xpos, self.data.xmat, self._index.body), self._step)

    def _end_step(self) -> None:
        """Let motors and pushes act over the physics step."""
        voltage = self._radio.received(self._step)
        if self._speed_loop:
            speed = self._wheel_speed[self._index.wheel_speed]
            voltage, self._integral_voltage = self._speed_loop.voltage(voltage, speed, self._integral_voltage)
        voltage = self._disturbances.without_dead_motors(voltage, self._step)
        changed = voltage is not self._voltage
        if changed:
            self._motors[:] = over_first_step(self._voltage, voltage)
        if self._disturbances.pushing:
            self.data.xfrc_applied[self._index.body, :2] = self._disturbances.force(self._step)
        mujoco.mj_step2(self.model, self.data)
        if changed:
            self._motors[:] = self._voltage = voltage
