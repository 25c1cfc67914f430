"""The paper's own plant (section 5.1): integrators, dq/dt = u."""

from __future__ import annotations

import numpy as np

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.plant.interface import Observation, Truth
from pbrg_mj.world.scene.footprints import wall_margin, wall_rectangles
from pbrg_mj.world.scene.robot import load_robot_model


class IdealPlant:
    """Integrators without beams. Bodies trail their hand points, all headed along +x."""

    model_xml = ""

    def __init__(self, scenario: Scenario):
        """Put the hand points at their start."""
        self.robot = load_robot_model()
        self._tick = scenario.timing.tick
        self._count = 0
        self._beams = scenario.sensors.beams.count
        self._walls = wall_rectangles(scenario.world.obstacles)
        self._q = np.array(scenario.team.start, dtype=float)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._count * self._tick

    def observe(self) -> Observation:
        """Return the exact poses, fresh at every tick, and no scans."""
        return Observation(
            body_pose=self._body_pose(), pose_frame=self._count, ranges=np.empty((0, self._beams)), scan_frame=-1
        )

    def truth(self) -> Truth:
        """Return the state. A disc the size of the robot touches a wall where the physical body would."""
        robots, body_pose = len(self._q), self._body_pose()
        body_gap = wall_margin(body_pose[:, :2], self._walls, self.robot.body_radius)
        return Truth(
            body_pose=body_pose,
            hand_world=self._q.copy(),
            wheel_speed=np.zeros((robots, 2)),
            wall_margin=wall_margin(self._q, self._walls, self.robot.clearance),
            wall_contact=body_gap < 0,
        )

    def advance(self, command: np.ndarray) -> None:
        """Integrate the held velocities (n, 2) [m/s] exactly over one tick."""
        self._q = self._q + self._tick * command
        self._count += 1

    def _body_pose(self) -> np.ndarray:
        behind = self._q - [self.robot.hand_offset, 0.0]
        return np.column_stack([behind, np.zeros(len(behind))])
