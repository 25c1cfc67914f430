"""One tick of the benchmark, in one direction.

physics -> raw ranges, raw poses -> readings -> half-spaces -> problem -> governor (rounds of messages)
-> governed references -> consensus control -> velocity filters -> wheel voltages -> physics
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple, cast

import numpy as np

from pbrg_mj.governor.problem.interface import Certificate, Governor, Problem, Solution, StateCertificate
from pbrg_mj.governor.problem.made_when_read import RowsToMake
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.governor.velocity_filter.interface import VelocityFilter
from pbrg_mj.governor.velocity_filter.separation import separation
from pbrg_mj.kernel import clock
from pbrg_mj.perception.estimator import Estimator, GuidedEstimator
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Control, Scenario, operator_reference
from pbrg_mj.sensing.noise import SensorNoise
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.sensing.sense import sense
from pbrg_mj.team.exchange import Exchange, ExchangeMemory
from pbrg_mj.team.network import Network
from pbrg_mj.team.pre_stabiliser import pre_stabilise
from pbrg_mj.vehicle.drive import Drive
from pbrg_mj.vehicle.hand_point import hand_point
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

    @cached_property
    def guided(self) -> GuidedEstimator | None:
        """The estimator if its half-spaces depend on where robots are going."""
        return self.estimator if isinstance(self.estimator, GuidedEstimator) else None

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
    def of_the_state(self) -> StateCertificate | None:
        """The certificate if its rows depend on the state, asked once: a protocol's check takes microseconds."""
        return self.certificate if isinstance(self.certificate, StateCertificate) else None


class PoseEstimate(NamedTuple):
    """Where the robots take themselves to be, by poses as they were read."""

    body_pose: np.ndarray  # (n, 3) x, y [m], heading [rad]
    hand_world: np.ndarray  # (n, 2) q [m]
    p: np.ndarray  # (n, 2) q - b [m]
    heading: np.ndarray  # (n,) of body_pose


class LoopState(NamedTuple):
    """What one tick hands to the next, besides the world."""

    readings: Readings | None  # None before the first tick
    estimator: Any  # its memory
    half_spaces: HalfSpaces | None  # None before the first tick
    rows: Rows | RowsToMake | None  # of the half-spaces known then; likewise None before the first tick
    pose: PoseEstimate | None  # likewise
    governor: Any  # likewise
    m: np.ndarray | None  # (n, 2) governed references [m]; likewise
    xi: np.ndarray  # (n, 2) [m]
    displacement: np.ndarray | None  # (n, 2) of q from p + b [m]; None where robots keep no distance
    exchange: ExchangeMemory | None = None  # of the pre-stabiliser's messages; None: before the first, or at once


class SeenTick(NamedTuple):
    """What the robots saw in one tick."""

    index: int  # pyright: ignore[reportIncompatibleMethodOverride] - not the one of tuples
    time: float  # [s]
    readings: Readings
    estimator: Any  # its memory after this tick
    half_spaces: HalfSpaces
    pose: PoseEstimate
    p: np.ndarray  # (n, 2) of the governor's problem: q - b less the displacement [m]
    timestamps: tuple[float, float, float]  # wall clock before sensing, and after sensing and perception [s]


class ControlTick(NamedTuple):
    """What the robots saw, concluded and commanded in one tick."""

    index: int  # pyright: ignore[reportIncompatibleMethodOverride] - not the one of tuples
    time: float  # [s]
    readings: Readings
    hand_world: np.ndarray  # (n, 2) q as estimated from the readings [m]
    half_spaces: HalfSpaces
    problem: Problem
    solution: Solution
    memory: Any  # the governor's, after its step
    displacement: np.ndarray | None  # (n, 2) of q from p + b [m]; None where robots keep no distance
    velocity: np.ndarray  # (n, 2) u of eq. 2, as velocity filters leave it [m/s]
    command: np.ndarray  # (n, 2) wheel voltages [V] or speeds [rad/s]; u [m/s] in the ideal plant
    timestamps: tuple[float, ...]  # wall clock before sensing, and after sensing, perception, governor, control [s]


class ExternalCommand(NamedTuple):
    """What somebody asks of the robots from outside; None: the operator's r, the velocities of eq. 2."""

    reference: np.ndarray | None = None  # (2,) in place of the operator's r [m]
    velocity: np.ndarray | None = None  # (n, 2) in place of u of eq. 2, before velocity filters [m/s]


def initial_state(loop: ClosedLoop) -> LoopState:
    """Return the state before the first tick."""
    xi = np.zeros((loop.network.robots, 2))
    displacement = None if separation(loop.scenario) is None else np.zeros_like(xi)
    return LoopState(None, loop.estimator.init(), None, None, None, None, None, xi, displacement)


def control_tick(loop: ClosedLoop, state: LoopState, index: int) -> tuple[LoopState, ControlTick]:
    """Do all of a tick but the physics; return the next state and what was done."""
    return commanded(loop, state, seen(loop, state, index))


def seen(loop: ClosedLoop, state: LoopState, index: int) -> SeenTick:
    """Do the first half of a tick: sense and perceive."""
    time = index * loop.tick
    began = clock()
    readings = sense(loop.world.observe(), state.readings, loop.noise)
    sensed = clock()

    if loop.guided is not None:
        half_spaces, estimator = loop.guided.step_towards(readings, time, state.estimator, state.m)
    else:
        half_spaces, estimator = loop.estimator.step(readings, time, state.estimator)
    perceived = clock()

    pose = state.pose
    if pose is None or readings.body_pose is not pose.body_pose:
        hand_world = hand_point(readings.body_pose, loop.hand_offset)
        heading = readings.body_pose[:, 2]
        pose = PoseEstimate(readings.body_pose, hand_world, hand_world - loop.formation, heading)
    p = pose.p if state.displacement is None else pose.p - state.displacement
    return SeenTick(index, time, readings, estimator, half_spaces, pose, p, (began, sensed, perceived))


def commanded(
    loop: ClosedLoop,
    state: LoopState,
    sight: SeenTick,
    demand: ExternalCommand = ExternalCommand(),  # noqa: B008 - a tuple
) -> tuple[LoopState, ControlTick]:
    """Do the second half: govern, control and command; return the next state and what was done."""
    problem = _problem(loop, state, sight, demand.reference)
    memory = loop.governor.init(problem) if state.governor is None else state.governor
    solution, memory = loop.governor.step(problem, memory)
    governed = clock()

    velocity, moved = _controlled(loop, state, sight, (problem, solution.m), demand.velocity)
    command = loop.drive.command(velocity, sight.readings.body_pose)
    tick = ControlTick(
        index=sight.index,
        time=sight.time,
        readings=sight.readings,
        hand_world=sight.pose.hand_world,
        half_spaces=sight.half_spaces,
        problem=problem,
        solution=solution,
        memory=memory,
        displacement=state.displacement,
        velocity=velocity,
        command=command,
        timestamps=(*sight.timestamps, governed, clock()),
    )
    rows = problem.rows_given
    kept = (sight.estimator, sight.half_spaces, rows, sight.pose, memory, solution.m, *moved)
    return LoopState(sight.readings, *kept), tick


def _problem(loop: ClosedLoop, state: LoopState, sight: SeenTick, asked: np.ndarray | None) -> Problem:
    """Return the governor's problem; r is the operator's, or what is asked from outside."""
    rows: Any = _rows(loop, state, sight.half_spaces, sight.p)
    return Problem(
        network=loop.network,
        p=sight.p,
        xi=state.xi,
        rows=rows,
        reference=loop.reference(sight.time) if asked is None else asked,
        half_spaces=sight.half_spaces,
        heading=sight.pose.heading,
        reference_range=loop.reference_range,
    )


def _controlled(
    loop: ClosedLoop,
    state: LoopState,
    sight: SeenTick,
    governed: tuple[Problem, np.ndarray],
    asked: np.ndarray | None,
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray | None, ExchangeMemory | None]]:
    """Return the velocities to drive (n, 2), and xi, displacement and exchange of the next tick.

    `governed` are the problem and the governed references, `asked` are velocities in place of those of eq. 2.
    """
    problem, m = governed
    velocity, xi_rate, exchange = _pre_stabilise(loop, state, problem, m)
    if asked is not None:
        velocity = asked
    driven, displacement = velocity, state.displacement
    for one in loop.velocity_filters:
        driven = one.filtered(problem, sight.pose.hand_world, m, driven)
    if displacement is not None:
        displacement = displacement + loop.tick * (driven - velocity)
    return driven, (state.xi + loop.tick * xi_rate, displacement, exchange)


def _pre_stabilise(
    loop: ClosedLoop, state: LoopState, problem: Problem, m: np.ndarray
) -> tuple[np.ndarray, np.ndarray, ExchangeMemory | None]:
    """Return u and dxi/dt, and what the robots then keep of each other where their messages are late or lost."""
    control, p, xi = loop.control, problem.p, problem.xi
    if loop.exchange is None:
        return *pre_stabilise(loop.network, control, p, xi, m, loop.backend), None
    heard = loop.exchange.carried(p, xi, loop.exchange.empty() if state.exchange is None else state.exchange)
    return *loop.exchange.rates(control, (p, xi), m, heard), heard


def _rows(loop: ClosedLoop, state: LoopState, half_spaces: HalfSpaces, p: np.ndarray) -> Rows | RowsToMake:
    """Return the certificate's rows: of the state, for who asks, or those of before while the half-spaces stay."""
    if loop.of_the_state is not None:
        owners, slots = half_spaces.h.shape
        made = partial(_rows_of_the_state, loop, half_spaces, (p, state.xi, state.m))
        return RowsToMake(made, (owners, 2 * slots))
    if state.rows is None or half_spaces is not state.half_spaces:
        return cast(Certificate, loop.certificate).rows(half_spaces)
    return state.rows


def _rows_of_the_state(loop: ClosedLoop, half_spaces: HalfSpaces, state: tuple[Any, ...]) -> Rows:
    """Return the rows at p, xi and the references applied in the tick before, None before the first one."""
    p, xi, m = state
    network, certificate = loop.network, cast(StateCertificate, loop.certificate)
    held = p.mean(axis=0) if m is None else network.leader @ m / network.leaders
    return certificate.rows_at(half_spaces, p, xi, held)
