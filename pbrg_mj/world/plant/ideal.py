"""The paper's own plant (section 5.1): integrators, dq/dt = u."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.plant.interface import Observation, Truth, TruthSample
from pbrg_mj.world.scene.footprints import wall_margin, world_footprints
from pbrg_mj.world.scene.obstacles import moving_footprints
from pbrg_mj.world.scene.robot import load_robot_model


class IdealPlant:
    """Integrators without beams. Bodies trail their hand points, all headed along +x."""

    model_xml = ""

    def __init__(self, scenario: Scenario):
        """Put the hand points at their start."""
        self.robot = load_robot_model(scenario.robot)
        self._tick = scenario.timing.tick
        self._count = 0
        self._beams = scenario.sensors.beams.count
        self._walls = world_footprints(scenario.world)
        self._moving_boxes = scenario.world.moving_boxes
        self._q = np.array(scenario.team.start, dtype=float)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._count * self._tick

    def observe(self) -> Observation:
        """Return the exact poses, fresh at every tick, and no scans."""
        return Observation(
            body_pose=self._body_pose(self._q), pose_frame=self._count, ranges=np.empty((0, self._beams)), scan_frame=-1
        )

    def truth(self) -> Truth:
        """Return the state. Contacts are those of discs the size of the robots; nothing stops the discs."""
        return self._truth(*self.sample_truth())

    def sample_truth(self) -> TruthSample:
        """Return time and hand points (n, 2) [m], an array that is never written to again."""
        return self.time, self._q

    def truths(self, samples: Sequence[TruthSample]) -> list[Truth]:
        """Return the truth at each sample."""
        return [self._truth(*sample) for sample in samples]

    def _truth(self, time: float, q: np.ndarray) -> Truth:
        body_pose, robot = self._body_pose(q), self.robot
        body, boxes = body_pose[:, :2], moving_footprints(self._moving_boxes, time)
        return Truth(
            body_pose=body_pose,
            hand_world=q.copy(),
            wheel_speed=np.zeros((len(q), 2)),
            wall_margin=wall_margin(q, self._walls, robot.clearance),
            wall_contact=wall_margin(body, self._walls, robot.body_radius) < 0,
            moving_margin=wall_margin(q, boxes, robot.clearance),
            moving_contact=wall_margin(body, boxes, robot.body_radius) < 0,
            robot_contact=_nearest_other(body) < 2 * robot.body_radius,
        )

    def advance(self, command: np.ndarray) -> None:
        """Integrate the held velocities (n, 2) [m/s] exactly over one tick."""
        self._q = self._q + self._tick * command
        self._count += 1

    def _body_pose(self, q: np.ndarray) -> np.ndarray:
        behind = q - [self.robot.hand_offset, 0.0]
        return np.column_stack([behind, np.zeros(len(behind))])


def _nearest_other(place: np.ndarray) -> np.ndarray:
    """Return the distance (n,) of each of `place` (n, 2) from the nearest other one; inf for one alone."""
    apart = np.linalg.norm(place[:, None] - place, axis=-1)
    np.fill_diagonal(apart, np.inf)
    return apart.min(axis=1)
