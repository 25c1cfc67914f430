"""From pose estimates and rows to wheel voltages in many worlds at once: governor, control and drive, compiled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj import plugins
from pbrg_mj.errors import InputError
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.governor.distributed.rounds import check_limits, rounds_in_new_arrays
from pbrg_mj.governor.problem.interface import Certificate, Problem, StateCertificate
from pbrg_mj.governor.problem.near_reference import write_near_references
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.governor.registry import certificate, governor
from pbrg_mj.governor.velocity_filter.separation import separation
from pbrg_mj.kernel import kernel
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.exchange import exchange
from pbrg_mj.team.graph import network
from pbrg_mj.team.network import Network
from pbrg_mj.team.pre_stabiliser import write_pre_stabilised
from pbrg_mj.vehicle.drive import DifferentialDrive, Motor, compensated_friction, write_wheel_voltages
from pbrg_mj.vehicle.hand_point import hand_point, write_hand_points
from pbrg_mj.world.scene.robot import load_robot_model


@dataclass(frozen=True)
class BatchParameters:
    """What all worlds have in common."""

    network: Network
    formation: np.ndarray  # (n, 2) b [m]
    certificate: Certificate
    governor: DistributedGovernor
    reference_range: float  # [m]
    control: tuple[float, float, float]  # alpha_r, leak, tick [s]
    sizes: tuple[float, float, float]  # of the robot: hand offset, half the track, wheels' radius [m]
    motor: Motor

    @classmethod
    def of(cls, scenario: Scenario) -> BatchParameters:
        """Return a scenario's team. Raises InputError unless it has the distributed governor, with plain messages."""
        graph, chosen = network(scenario), governor(scenario)
        robot, drive = load_robot_model(scenario.robot), scenario.drive
        sizes, motor = DifferentialDrive(robot, drive.pwm_levels, compensated_friction(drive, robot)).parameters
        if not isinstance(chosen, DistributedGovernor) or chosen.channel is not None or chosen.backend != "compiled":
            only = "a batch runs the distributed governor alone, compiled, without delay, loss or outage"
            raise InputError(f"{only}; run the seeds one by one", key="governor")
        if exchange(scenario) is not None:
            only = "a batch exchanges p and xi at once"
            raise InputError(f"{only}; run the seeds one by one", key="network.pre_stabiliser")
        if separation(scenario) is not None:
            raise InputError("a batch filters no velocities; run the seeds one by one", key="control.separation")
        rows = certificate(scenario)
        if isinstance(rows, StateCertificate):
            raise InputError("a batch has rows of the ball alone; run the seeds one by one", key="governor.certificate")
        for kind in (plugins.CERTIFICATE, plugins.ESTIMATOR, plugins.NOISE_MODEL):
            if plugins.value_at(scenario, kind.key) not in kind.built_in:
                only = f"worlds side by side have no {kind.noun} of a plug-in"
                raise InputError(f"{only}; run the seeds one by one", key=kind.key)
        return cls(
            network=graph,
            formation=np.array(scenario.team.formation, dtype=float),
            certificate=rows,
            governor=chosen,
            reference_range=scenario.governor.reference_range,
            control=(scenario.control.alpha_r, scenario.control.leak, scenario.timing.tick),
            sizes=sizes,
            motor=motor,
        )


@dataclass(frozen=True)
class BatchState:
    """The state of W worlds' teams. `step` moves it on in place; threads take worlds of their own."""

    pose: np.ndarray  # (W, n, 3) as the robots know them
    rows: tuple[np.ndarray, ...]  # a, C, d, active, along of Rows, worlds first
    xi: np.ndarray  # (W, n, 2) [m]
    estimates: tuple[np.ndarray, ...]  # z, zeta, lam, nu of Estimates, worlds first
    m: np.ndarray  # (W, n, 2) [m]
    diverged: np.ndarray  # (W,) bool
    command: np.ndarray  # (W, n, 2) left, right [V]

    @classmethod
    def blank(cls, team: BatchParameters, worlds: int, rows: Rows) -> BatchState:
        """Return the state of W worlds that all know the same rows."""
        n = team.network.robots
        row_arrays = tuple(np.stack([array] * worlds) for array in rows)
        widths = (4 * n + 2, 4 * n + 2, rows.d.shape[1], 4)
        return cls(
            pose=np.empty((worlds, n, 3)),
            rows=row_arrays,
            xi=np.zeros((worlds, n, 2)),
            estimates=tuple(np.zeros((worlds, n, width)) for width in widths),
            m=np.zeros((worlds, n, 2)),
            diverged=np.zeros(worlds, dtype=bool),
            command=np.zeros((worlds, n, 2)),
        )

    def initialise(self, team: BatchParameters, reference: np.ndarray) -> None:
        """Take the governor's first estimates in every world, from the poses known by now."""
        for world, pose in enumerate(self.pose):
            p = hand_point(pose, team.sizes[0]) - team.formation
            rows = self._rows_of(world)
            memory = team.governor.init(
                Problem(team.network, p, self.xi[world], rows, reference, reference_range=team.reference_range)
            )
            first = memory.estimates
            for array, value in zip(self.estimates, (first.z, first.zeta, first.lam, first.nu), strict=True):
                array[world] = value
            self.m[world], self.diverged[world] = memory.m, memory.diverged

    def set_rows(self, world: int, rows: Rows) -> None:
        """Set a world's new rows."""
        for array, value in zip(self.rows, rows, strict=True):
            array[world] = value

    def step(self, team: BatchParameters, worlds: range, reference: np.ndarray) -> None:
        """Bring estimates, m, xi and commands of some worlds to the next tick."""
        net, governor = team.network, team.governor
        _step(
            (worlds.start, worlds.stop),
            (self.pose, self.xi, self.m, self.diverged, self.command),
            self.estimates,
            self.rows,
            ((net.first, net.neighbours, net.leader), team.formation, reference, team.reference_range),
            (
                (governor.flow.alpha, governor.flow.step, governor.flow.multiplier_cap),
                (governor.rounds, governor.diverged_beyond),
                team.control,
                team.sizes,
                team.motor,
            ),
        )

    def _rows_of(self, world: int) -> Rows:
        return Rows(*(array[world] for array in self.rows))


@kernel
def _step(worlds, states, estimates, rows, team, numbers):
    """Do for each of the worlds what `tick` does between perception and physics."""
    pose, xi, m, diverged, command = states
    graph, formation, r, reach = team
    gains, (rounds, beyond), (alpha_r, leak, tick), sizes, motor = numbers
    p, u, rate = np.empty(formation.shape), np.empty(formation.shape), np.empty(formation.shape)
    near = np.empty(formation.shape)
    for w in range(*worlds):
        write_hand_points(pose[w], sizes[0], p)
        p -= formation
        write_near_references(p, r, reach, near)
        before = (estimates[0][w], estimates[1][w], estimates[2][w], estimates[3][w])
        own_rows = (rows[0][w], rows[1][w], rows[2][w], rows[3][w], rows[4][w])
        after = rounds_in_new_arrays(before, graph, (p, xi[w], near), own_rows, gains, 0 if diverged[w] else rounds)
        estimates[0][w], estimates[1][w], estimates[2][w], estimates[3][w] = after
        diverged[w] = not check_limits(after[0], after[2], beyond, gains[2])[0]
        if not diverged[w]:
            m[w] = after[0][:, :2]
        write_pre_stabilised(graph, (p, xi[w], m[w]), alpha_r, leak, u, rate)
        write_wheel_voltages(u, pose[w], sizes, motor, command[w])
        xi[w] += tick * rate
