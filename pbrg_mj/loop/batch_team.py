"""The teams of many worlds side by side: what they have in common, their states, and how these move by eq. 2."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pbrg_mj import plugins
from pbrg_mj.errors import InputError
from pbrg_mj.governor.registry import velocity_filters
from pbrg_mj.governor.velocity_filter.separation import SeparationFilter, write_driven
from pbrg_mj.kernel import kernel
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.exchange import exchange
from pbrg_mj.team.graph import network
from pbrg_mj.team.network import Network
from pbrg_mj.team.pre_stabiliser import write_pre_stabilised
from pbrg_mj.vehicle.drive import DifferentialDrive, Motor, compensated_friction, write_wheel_voltages
from pbrg_mj.vehicle.hand_point import write_hand_points
from pbrg_mj.world.scene.robot import load_robot_model

NO_FILTER = np.zeros((0, 2)), (0.0,) * 6, False


@dataclass(frozen=True)
class BatchTeam:
    """What all worlds have in common but for the governor."""

    network: Network
    formation: np.ndarray  # (n, 2) b [m]
    control: tuple[float, float, float]  # alpha_r, leak, tick [s]
    sizes: tuple[float, float, float]  # of the robot: hand offset, half the track, wheels' radius [m]
    motor: Motor
    separation: SeparationFilter | None  # None: robots are no obstacles

    @classmethod
    def of(cls, scenario: Scenario) -> BatchTeam:
        """Return a scenario's team. Raises InputError for what is not compiled for worlds side by side."""
        if exchange(scenario) is not None:
            only = "a batch exchanges p and xi at once"
            raise InputError(f"{only}; run the seeds one by one", key="network.pre_stabiliser")
        robot, drive, filters = load_robot_model(scenario.robot), scenario.drive, velocity_filters(scenario)
        sizes, motor = DifferentialDrive(robot, drive.pwm_levels, compensated_friction(drive, robot)).parameters
        apart = [one for one in filters if isinstance(one, SeparationFilter)]
        if len(apart) < len(filters):
            only = "a batch filters velocities for separation alone"
            raise InputError(f"{only}; run the seeds one by one", key="governor")
        return cls(
            network=network(scenario),
            formation=np.array(scenario.team.formation, dtype=float),
            control=(scenario.control.alpha_r, scenario.control.leak, scenario.timing.tick),
            sizes=sizes,
            motor=motor,
            separation=apart[0] if apart else None,
        )

    @cached_property
    def packed(self) -> tuple[Any, ...]:
        """What the kernels take: graph, formation, control, sizes, motor, and the facets and numbers of separation."""
        apart, separation = self.separation, NO_FILTER
        if apart is not None:
            separation = apart.facets, apart.numbers, True
        return self.network.arrays, self.formation, self.control, self.sizes, self.motor, separation


def check_built_in(scenario: Scenario) -> None:
    """Raise InputError for parts of plug-ins that worlds side by side would have to share."""
    for kind in (plugins.CERTIFICATE, plugins.ESTIMATOR, plugins.NOISE_MODEL):
        if plugins.value_at(scenario, kind.key) not in kind.built_in:
            only = f"worlds side by side have no {kind.noun} of a plug-in"
            raise InputError(f"{only}; run the seeds one by one", key=kind.key)


@dataclass(frozen=True)
class TeamStates:
    """The states of W worlds' teams, whatever their governor; they move on in place."""

    pose: np.ndarray  # (W, n, 3) as the robots know them
    xi: np.ndarray  # (W, n, 2) [m]
    displacement: np.ndarray  # (W, n, 2) of q from p + b [m]; 0 where robots keep no distance
    m: np.ndarray  # (W, n, 2) [m]
    diverged: np.ndarray  # (W,) bool
    command: np.ndarray  # (W, n, 2) left, right [V]

    @classmethod
    def initial(cls, worlds: int, robots: int) -> TeamStates:
        """Return the states before the first tick."""
        pairs = (np.zeros((worlds, robots, 2)) for _ in range(4))
        xi, displacement, m, command = pairs
        return cls(np.empty((worlds, robots, 3)), xi, displacement, m, np.zeros(worlds, dtype=bool), command)

    def p(self, team: BatchTeam) -> np.ndarray:
        """Return p (W, n, 2) [m]."""
        q, p = np.empty(self.m.shape), np.empty(self.m.shape)
        _write_all_places(self.pose, self.displacement, team.packed, q, p)
        return p

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """All of them, in their order."""
        return self.pose, self.xi, self.displacement, self.m, self.diverged, self.command


@kernel
def _write_all_places(pose, displacement, team, q, p):
    """Do the same for all worlds: q and p (W, n, 2) [m]."""
    for w in range(len(pose)):
        write_places(pose[w], displacement[w], team, q[w], p[w])


@kernel
def write_places(pose, displacement, team, q, p):
    """Write one world's q and p (n, 2) [m] of pose (n, 3) and displacement (n, 2).

    `team` (a tuple, in its order) is `BatchTeam.packed`.
    """
    formation, sizes, apart = team[1], team[3], team[5][2]
    write_hand_points(pose, sizes[0], q)
    for j in range(len(q)):
        for axis in range(2):
            p[j, axis] = q[j, axis] - formation[j, axis]
            if apart:
                p[j, axis] -= displacement[j, axis]


@kernel
def control_world(w, states, places, half_spaces, team):
    """Do in world w what `tick` does between governor and physics.

    `states` are `TeamStates.arrays`; `places` q and p of this world; `half_spaces` G, h, active, binds, closing of all
    worlds; `team` is `BatchTeam.packed`.
    """
    pose, xi, displacement, m, _, command = states
    q, p = places
    graph, formation, (alpha_r, leak, tick), sizes, motor, (facets, numbers, apart) = team
    u, rate, driven = np.empty(p.shape), np.empty(p.shape), np.empty(p.shape)
    write_pre_stabilised(graph, (p, xi[w], m[w]), alpha_r, leak, u, rate)
    if apart:
        G, h, active, binds, closing = half_spaces
        spaces = (G[w], h[w], active[w], binds[w], closing[w])
        write_driven(spaces, (q, p, formation, u), (pose[w][:, 2], facets), numbers, driven)
    for j in range(len(p)):
        for axis in range(2):
            if apart:
                displacement[w, j, axis] += tick * (driven[j, axis] - u[j, axis])
                u[j, axis] = driven[j, axis]
            xi[w, j, axis] += tick * rate[j, axis]
    write_wheel_voltages(u, pose[w], sizes, motor, command[w])
