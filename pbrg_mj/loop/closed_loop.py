"""What the closed loop is made of."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pbrg_mj.governor.problem.interface import Certificate, Governor, StateCertificate
from pbrg_mj.governor.velocity_filter.interface import VelocityFilter
from pbrg_mj.loop.compiled_control import CompiledControl
from pbrg_mj.perception.estimator import Estimator, GoalDirectedEstimator
from pbrg_mj.scenario.schema import Control, Scenario, operator_reference
from pbrg_mj.sensing.noise import SensorNoise
from pbrg_mj.team.exchange import Exchange
from pbrg_mj.team.network import Network
from pbrg_mj.vehicle.drive import Drive
from pbrg_mj.vehicle.motor_lag import MotorLag, motor_lag
from pbrg_mj.world.plant.interface import Plant


@dataclass(frozen=True)
class ClosedLoop:
    """What the closed loop is made of; nothing here changes but the world inside `world`."""

    scenario: Scenario
    world: Plant
    noise: SensorNoise
    estimator: Estimator
    network: Network
    formation: np.ndarray  # (n, 2) b [m]
    hand_offset: float  # [m]
    certificate: Certificate | StateCertificate
    governor: Governor
    drive: Drive
    velocity_filters: tuple[VelocityFilter, ...] = ()  # in the order in which they change u
    exchange: Exchange | None = None  # of p and xi; None: all of it arrives at once
    compiled_control: CompiledControl | None = None  # of the same control; None: part by part

    @cached_property
    def goal_directed(self) -> GoalDirectedEstimator | None:
        """The estimator if its half-spaces depend on where robots are going."""
        return self.estimator if isinstance(self.estimator, GoalDirectedEstimator) else None

    @cached_property
    def tick(self) -> float:
        """Seconds from tick to tick. Like what follows, kept here since a section's key takes longer to find."""
        return self.scenario.timing.tick

    @cached_property
    def control(self) -> Control:
        """The scenario's section."""
        return self.scenario.control

    @cached_property
    def backend(self) -> str:
        """Of governor and pre-stabiliser."""
        return self.scenario.governor.backend

    @cached_property
    def motor_lag(self) -> MotorLag | None:
        """How robots compute their own motion; None where the governor does not ask."""
        return motor_lag(self.scenario)

    @cached_property
    def reference_range(self) -> float:
        """How far away the operator's reference may pull [m]."""
        return self.scenario.governor.reference_range

    def reference(self, time: float) -> np.ndarray:
        """Return the operator's r (2,) [m]."""
        constant = self._constant_reference
        return operator_reference(self.scenario.operator, time) if constant is None else constant

    @cached_property
    def _constant_reference(self) -> np.ndarray | None:
        operator = self.scenario.operator
        return None if operator.reference is None else operator_reference(operator, 0.0)

    @cached_property
    def state_certificate(self) -> StateCertificate | None:
        """The certificate if its rows depend on the state, asked once: a protocol's check takes microseconds."""
        return self.certificate if isinstance(self.certificate, StateCertificate) else None
