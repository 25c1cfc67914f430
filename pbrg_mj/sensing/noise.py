"""What the sensors add to the truth."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from pbrg_mj import plugins
from pbrg_mj.errors import InputError
from pbrg_mj.scenario.random_streams import Source, Streams
from pbrg_mj.scenario.schema import Scenario, per_robot
from pbrg_mj.sensing.camera_faults import CameraFaults, camera_faults
from pbrg_mj.sensing.frame_buffer import FrameBuffer
from pbrg_mj.sensing.noise_model import PlugInNoise
from pbrg_mj.sensing.pose_filter import FilterParameters
from pbrg_mj.sensing.signal_strength import SignalStrength
from pbrg_mj.sensing.ultra_wideband import Radio, radio_of
from pbrg_mj.world.scene.robot import load_robot_model

BeamNumbers = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Standard normal, uniform in [0, 1), normal (b, beams) and uniform (b, 2 beams) numbers of b scans."""
CAMERA_FRAMES = 16  # whose numbers are drawn in a row
BEAM_FRAMES = 4  # likewise; some hundred times as many numbers as a frame of the camera takes
LEAST_STD = 1e-6  # [m], [rad] of a camera that the filter takes for exact


@dataclass(frozen=True)
class SensorNoise:
    """Noise of all sensors of a run. SI; angles in rad."""

    seed: int
    beam_robots: tuple[int, ...]  # robot of each row of the ranges, from 0, ascending
    position_std: float  # [m]
    heading_std: float  # [rad]
    range_min: float  # [m]
    range_max: float  # [m]
    range_std: float  # additive part [m]
    dropout: float  # probability that a beam returns nothing
    range_ratio: float = 0.0  # multiplicative part: standard deviation per range [-]
    quantum: float = 0.0  # ranges are whole multiples of this [m]; 0: any range
    outliers: float = 0.0  # probability that a beam returns anything within the limits
    range_bias: tuple[float, ...] = ()  # of each row of the ranges [m]; empty: none
    pose_bias: tuple[tuple[float, float, float], ...] = ()  # of each robot's x, y [m], heading [rad]; empty: none
    beam_bias_std: float = 0.0  # of the constant errors of single beams [m]
    rays: int = 1  # that stand for a beam
    signal: SignalStrength | None = None  # power that an echo takes; None: none
    camera_faults: CameraFaults | None = None
    radio: Radio | None = None  # for x and y in place of the camera
    pose_filter: FilterParameters | None = None  # fuses encoders with the camera
    frame_period: float = 0.0  # of the camera, for the filter [s]
    timestamp_offset: float = 0.0  # by how much the filter takes exposures for later than they are [s]
    model: PlugInNoise | None = None  # in place of all that, but for the limits

    @cached_property
    def camera_streams(self) -> Streams:
        """Random streams of the camera."""
        return Streams(self.seed, Source.CAMERA)

    @cached_property
    def pose_std(self) -> np.ndarray:
        """Standard deviations of x, y [m] and heading [rad], (3,)."""
        return np.array([self.position_std, self.position_std, self.heading_std])

    @cached_property
    def camera_draws(self) -> FrameBuffer[np.ndarray]:
        """What is drawn for x, y and heading (n, 3) in the camera's frames."""
        return FrameBuffer(CAMERA_FRAMES)

    @cached_property
    def beam_streams(self) -> Streams:
        """Random streams of the beams."""
        return Streams(self.seed, Source.BEAMS)

    @cached_property
    def beam_draws(self) -> FrameBuffer[BeamNumbers]:
        """What is drawn for the scans of all robots, in the frames of the beams."""
        return FrameBuffer(BEAM_FRAMES)

    @cached_property
    def radio_streams(self) -> Streams:
        """Random streams of the radio ranges."""
        return Streams(self.seed, Source.RADIO_RANGES)

    @cached_property
    def signal_streams(self) -> Streams:
        """Random streams of the power that comes back."""
        return Streams(self.seed, Source.SIGNAL)

    def beam_biases(self, beams: int) -> np.ndarray:
        """Return the constant errors (R, beams) [m] of all beams: the robots' and the beams' own."""
        streams, biases = Streams(self.seed, Source.BEAM_BIAS), np.zeros((len(self.beam_robots), beams))
        if self.beam_bias_std:
            for row, robot in enumerate(self.beam_robots):
                biases[row] = self.beam_bias_std * streams.at(robot, 0).standard_normal(beams)
        return biases + np.array(self.range_bias)[:, None] if self.range_bias else biases


def sensor_noise(scenario: Scenario, given: Any = None) -> SensorNoise:
    """Return the noise of a scenario's sensors, with the model of a plug-in, or the object `given`, if there is one.

    Raises InputError for an unknown name and wrong options, PlugInError when a plug-in cannot be built.
    """
    name, numbers = scenario.sensors.noise_model, noise_parameters(scenario)
    if scenario.plant == "ideal" or (given is None and name in plugins.NOISE_MODEL.built_in):
        return numbers
    name, built = plugins.build(plugins.NOISE_MODEL, scenario, given)
    return replace(numbers, model=PlugInNoise(built, name, scenario.timing.plug_in_limit))


def noise_parameters(scenario: Scenario) -> SensorNoise:
    """Return the numbers of a scenario's sensors; the ideal plant is seen exactly (range limits still hold)."""
    beams, camera = scenario.sensors.beams, scenario.sensors.camera
    exact = scenario.plant == "ideal"
    range_bias = [per_robot(beams.bias, scenario.robots)[robot] for robot in scenario.beam_robots]
    headings = np.deg2rad(per_robot(camera.heading_bias_deg, scenario.robots)).tolist()
    places = (per_robot(given, scenario.robots) for given in (camera.bias_x, camera.bias_y))
    pose_bias = tuple(zip(*places, headings, strict=True))
    return SensorNoise(
        seed=scenario.seed,
        beam_robots=scenario.beam_robots,
        position_std=0.0 if exact else camera.position_std,
        heading_std=0.0 if exact else float(np.deg2rad(camera.heading_std_deg)),
        range_min=beams.range_min,
        range_max=beams.range_max,
        range_std=0.0 if exact else beams.noise_std,
        dropout=0.0 if exact else beams.dropout,
        range_ratio=0.0 if exact else beams.noise_ratio,
        quantum=0.0 if exact else beams.quantum,
        outliers=0.0 if exact else beams.outliers,
        range_bias=tuple(range_bias) if any(range_bias) and not exact else (),
        pose_bias=pose_bias if np.any(pose_bias) and not exact else (),
        beam_bias_std=0.0 if exact else beams.beam_bias_std,
        rays=beams.rays,
        signal=None if exact or beams.signal_range is None else SignalStrength(beams.signal_range, beams.signal_spread),
        camera_faults=camera_faults(scenario),
        radio=None if exact or not scenario.sensors.uwb.anchors else radio_of(scenario.sensors.uwb),
        **_fused(scenario),
    )


def _fused(scenario: Scenario) -> dict[str, Any]:
    """Return what `SensorNoise` holds of the filter; nothing where robots know the camera alone."""
    odometry, camera = scenario.sensors.odometry, scenario.assumed_sensors.camera
    if not odometry.fuse:
        return {}
    robot = load_robot_model(scenario.robot)
    if robot.omnidirectional:
        raise InputError(
            f"is true, and robot {scenario.robot} has no wheels to count; allowed: false", key="sensors.odometry.fuse"
        )
    parameters = FilterParameters(
        track=robot.track,
        wheel_radius=robot.wheel_radius,
        step=2.0 * np.pi / odometry.steps_per_turn,
        slip=odometry.slip,
        position_std=max(camera.position_std, LEAST_STD),
        heading_std=max(float(np.deg2rad(camera.heading_std_deg)), LEAST_STD),
    )
    return {
        "pose_filter": parameters,
        "frame_period": max(1.0 / camera.rate_hz, scenario.timing.physics_step),
        "timestamp_offset": scenario.sensors.camera.delay - camera.delay,
    }
