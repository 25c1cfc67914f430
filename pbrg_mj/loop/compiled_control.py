"""From governed references to wheel voltages in one compiled call: eq. 2, the distance between robots, the drive.

What `tick` does of robots on two wheels that voltage drives, where p and xi arrive at once. Of one run and of many
worlds side by side.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from pbrg_mj.governor.velocity_filter.interface import VelocityFilter
from pbrg_mj.governor.velocity_filter.separation import SeparationFilter, write_driven
from pbrg_mj.kernel import kernel
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.graph import network
from pbrg_mj.team.network import Network
from pbrg_mj.team.pre_stabiliser import write_pre_stabilised
from pbrg_mj.vehicle.drive import DifferentialDrive, Drive, Motor, write_wheel_voltages

NO_SEPARATION = np.zeros((0, 2)), (0.0,) * 6, False


class ControlOutput(NamedTuple):
    """What a tick's control commands, and what it hands to the next tick."""

    velocity: np.ndarray  # (n, 2) u of eq. 2, as the filter leaves it [m/s]
    command: np.ndarray  # (n, 2) left, right [V]
    xi: np.ndarray  # (n, 2) [m]
    displacement: np.ndarray  # (n, 2) of q from p + b [m]; 0 where robots keep no distance


@dataclass(frozen=True)
class CompiledControl:
    """Pre-stabiliser, separation and drive, as arrays and numbers."""

    network: Network
    formation: np.ndarray  # (n, 2) b [m]
    control: tuple[float, float, float]  # alpha_r, leak, tick [s]
    sizes: tuple[float, float, float]  # of the robot: hand offset, half the track, wheels' radius [m]
    motor: Motor
    separation: SeparationFilter | None  # None: robots are no obstacles

    @classmethod
    def of(cls, scenario: Scenario, drive: Drive, filters: tuple[VelocityFilter, ...]) -> CompiledControl | None:
        """Return the control of a scenario's drive and filters; None for others than those that are compiled.

        Whether p and xi arrive at once is the caller's to know.
        """
        apart = [one for one in filters if isinstance(one, SeparationFilter)]
        if not isinstance(drive, DifferentialDrive) or len(apart) < len(filters):
            return None
        return cls(
            network=network(scenario),
            formation=np.array(scenario.team.formation, dtype=float),
            control=(scenario.control.alpha_r, scenario.control.leak, scenario.timing.tick),
            sizes=drive.parameters[0],
            motor=drive.parameters[1],
            separation=apart[0] if apart else None,
        )

    @cached_property
    def packed(self) -> tuple[Any, ...]:
        """What kernels take: graph, formation, control, sizes, motor, and the facets and numbers of separation."""
        apart, separation = self.separation, NO_SEPARATION
        if apart is not None:
            separation = apart.facets, apart.numbers, True
        return self.network.arrays, self.formation, self.control, self.sizes, self.motor, separation

    def step(self, half_spaces: HalfSpaces, state: tuple[np.ndarray, ...], forbidden: bool) -> ControlOutput:
        """Return a tick's control; `state` are pose (n, 3) and q, p, xi, m, displacement, each (n, 2) [m], [rad].

        `forbidden` tells whether rows forbid m.
        """
        shape = self.formation.shape
        written = np.empty(shape), np.empty(shape), np.empty(shape), np.empty(shape)
        write_control(half_spaces.arrays, (*state, forbidden), self.packed, written)
        return ControlOutput(*written)


@kernel
def write_control(half_spaces, state, team, written):
    """Write velocity, command, next_xi, next_displacement (n, 2), the members of `ControlOutput`.

    The last two may be the arrays of the state. `half_spaces` are `HalfSpaces.arrays`; `state`
    those of `CompiledControl.step` and `forbidden`, whether rows forbid m; `team` is `CompiledControl.packed`.
    """
    pose, q, p, xi, m, displacement, forbidden = state
    velocity, command, next_xi, next_displacement = written
    graph, formation, (alpha_r, leak, tick), sizes, motor, (facets, numbers, apart) = team
    u, rate = np.empty(p.shape), np.empty(p.shape)
    write_pre_stabilised(graph, (p, xi, m), alpha_r, leak, u, rate)
    if apart:
        write_driven(half_spaces, (q, p, formation, u, forbidden), (pose[:, 2], facets), numbers, velocity)
    for j in range(len(p)):
        for axis in range(2):
            if apart:
                next_displacement[j, axis] = displacement[j, axis] + tick * (velocity[j, axis] - u[j, axis])
            else:
                velocity[j, axis], next_displacement[j, axis] = u[j, axis], 0.0
            next_xi[j, axis] = xi[j, axis] + tick * rate[j, axis]
    write_wheel_voltages(velocity, pose, sizes, motor, command)
