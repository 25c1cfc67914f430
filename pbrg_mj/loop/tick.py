"""One tick of the benchmark, in one direction.

physics -> raw ranges, raw poses -> readings -> half-spaces -> problem -> governor (rounds of messages)
-> governed references -> consensus control -> velocity filters -> wheel voltages -> physics
"""

from __future__ import annotations

from functools import partial
from typing import Any, cast

import numpy as np

from pbrg_mj.governor.problem.interface import FORBIDDEN, Certificate, Problem, Solution, StateCertificate
from pbrg_mj.governor.problem.lazy_rows import LazyRows
from pbrg_mj.governor.problem.motion import prediction_state
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.governor.velocity_filter.separation import separation
from pbrg_mj.kernel import clock
from pbrg_mj.loop.closed_loop import ClosedLoop
from pbrg_mj.loop.compiled_control import CompiledControl
from pbrg_mj.loop.tick_data import ControlTick, ExternalCommand, LoopState, PoseEstimate, SensedTick
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.sensing.sense import sense
from pbrg_mj.team.exchange import ExchangeMemory
from pbrg_mj.team.pre_stabiliser import pre_stabilise
from pbrg_mj.vehicle.hand_point import hand_point

Moved = tuple[np.ndarray, np.ndarray | None, ExchangeMemory | None, np.ndarray | None]
"""xi, displacement, exchange and motion of the next tick's `LoopState`."""


def initial_state(loop: ClosedLoop) -> LoopState:
    """Return the state before the first tick."""
    xi = np.zeros((loop.network.robots, 2))
    displacement = None if separation(loop.scenario) is None else np.zeros_like(xi)
    motion = None if loop.motor_lag is None else loop.motor_lag.at_rest(len(xi))
    return LoopState(None, loop.estimator.init(), None, None, None, None, None, xi, displacement, motion=motion)


def control_tick(loop: ClosedLoop, state: LoopState, index: int) -> tuple[LoopState, ControlTick]:
    """Do all of a tick but the physics; return the next state and what was done."""
    return govern_and_command(loop, state, sense_and_perceive(loop, state, index))


def sense_and_perceive(loop: ClosedLoop, state: LoopState, index: int) -> SensedTick:
    """Do the first half of a tick: sense and perceive."""
    time = index * loop.tick
    began = clock()
    readings = sense(loop.world.observe(), state.readings, loop.noise)
    sensed = clock()

    if loop.goal_directed is not None:
        half_spaces, estimator = loop.goal_directed.step_towards(readings, time, state.estimator, state.m)
    else:
        half_spaces, estimator = loop.estimator.step(readings, time, state.estimator)
    perceived = clock()

    pose = state.pose
    if pose is None or readings.body_pose is not pose.body_pose:
        hand_world = hand_point(readings.body_pose, loop.hand_offset)
        heading = readings.body_pose[:, 2]
        pose = PoseEstimate(readings.body_pose, hand_world, hand_world - loop.formation, heading)
    p = pose.p if state.displacement is None else pose.p - state.displacement
    return SensedTick(index, time, readings, estimator, half_spaces, pose, p, (began, sensed, perceived))


def govern_and_command(
    loop: ClosedLoop,
    state: LoopState,
    sensed: SensedTick,
    external: ExternalCommand = ExternalCommand(),  # noqa: B008 - a tuple
) -> tuple[LoopState, ControlTick]:
    """Do the second half: govern, control and command; return the next state and what was done."""
    problem = _problem(loop, state, sensed, external.reference)
    memory = loop.governor.init(problem) if state.governor is None else state.governor
    solution, memory = loop.governor.step(problem, memory)
    governed = clock()

    velocity, command, moved = _controlled(loop, state, sensed, (problem, solution), external.velocity)
    tick = ControlTick(
        index=sensed.index,
        time=sensed.time,
        readings=sensed.readings,
        hand_world=sensed.pose.hand_world,
        half_spaces=sensed.half_spaces,
        problem=problem,
        solution=solution,
        memory=memory,
        displacement=state.displacement,
        velocity=velocity,
        command=command,
        timestamps=(*sensed.timestamps, governed, clock()),
    )
    rows = problem.rows_given
    kept = (sensed.estimator, sensed.half_spaces, rows, sensed.pose, memory, solution.m, *moved)
    return LoopState(sensed.readings, *kept), tick


def _problem(loop: ClosedLoop, state: LoopState, sensed: SensedTick, asked: np.ndarray | None) -> Problem:
    """Return the governor's problem; r is the operator's, or what is asked from outside."""
    rows: Any = _rows(loop, state, sensed.half_spaces, sensed.p)
    return Problem(
        network=loop.network,
        p=sensed.p,
        xi=state.xi,
        rows=rows,
        reference=loop.reference(sensed.time) if asked is None else asked,
        half_spaces=sensed.half_spaces,
        heading=sensed.pose.heading,
        reference_range=loop.reference_range,
        motion=state.motion,
    )


def _controlled(
    loop: ClosedLoop,
    state: LoopState,
    sensed: SensedTick,
    governed: tuple[Problem, Solution],
    asked: np.ndarray | None,
) -> tuple[np.ndarray, np.ndarray, Moved]:
    """Return the velocities to drive (n, 2), the plant's commands (n, 2) for them, and the states of the next tick.

    `governed` are the problem and the governor's answer, `asked` are velocities in place of those of eq. 2.
    """
    if loop.compiled_control is not None and asked is None:
        return _controlled_at_once(loop.compiled_control, state, sensed, governed)
    problem, solution = governed
    velocity, xi_rate, exchange = _pre_stabilise(loop, state, problem, solution.m)
    if asked is not None:
        velocity = asked
    driven, displacement = velocity, state.displacement
    for one in loop.velocity_filters:
        driven = one.filtered(problem, solution, sensed.pose.hand_world, driven)
    if displacement is not None:
        displacement = displacement + loop.tick * (driven - velocity)
    # p is q - b less the displacement, so it moves by the velocity before filters.
    motion = None if loop.motor_lag is None or state.motion is None else loop.motor_lag.after(state.motion, velocity)
    command = loop.drive.command(driven, sensed.readings.body_pose)
    return driven, command, (state.xi + loop.tick * xi_rate, displacement, exchange, motion)


def _controlled_at_once(
    control: CompiledControl, state: LoopState, sensed: SensedTick, governed: tuple[Problem, Solution]
) -> tuple[np.ndarray, np.ndarray, Moved]:
    """Return the same in one call: between two steps of physics, every call of NumPy costs microseconds."""
    pose, (problem, solution), displacement = sensed.pose, governed, state.displacement
    kept = problem.xi if displacement is None else displacement  # without separation it is not read
    given = pose.body_pose, pose.hand_world, problem.p, problem.xi, solution.m, kept
    velocity, command, xi, moved = control.step(sensed.half_spaces, given, solution.status in FORBIDDEN)
    return velocity, command, (xi, None if displacement is None else moved, None, None)


def _pre_stabilise(
    loop: ClosedLoop, state: LoopState, problem: Problem, m: np.ndarray
) -> tuple[np.ndarray, np.ndarray, ExchangeMemory | None]:
    """Return u and dxi/dt, and what the robots then keep of each other where their messages are late or lost."""
    control, p, xi = loop.control, problem.p, problem.xi
    if loop.exchange is None:
        return *pre_stabilise(loop.network, control, p, xi, m, loop.backend), None
    received = loop.exchange.transmitted(p, xi, loop.exchange.empty() if state.exchange is None else state.exchange)
    return *loop.exchange.rates(control, (p, xi), m, received), received


def _rows(loop: ClosedLoop, state: LoopState, half_spaces: HalfSpaces, p: np.ndarray) -> Rows | LazyRows:
    """Return the certificate's rows: of the state, for who asks, or those of before while the half-spaces stay."""
    if loop.state_certificate is not None:
        owners, slots = half_spaces.h.shape
        made = partial(_rows_of_the_state, loop, half_spaces, p, state)
        return LazyRows(made, (owners, 2 * slots))
    if state.rows is None or half_spaces is not state.half_spaces:
        return cast(Certificate, loop.certificate).rows(half_spaces)
    return state.rows


def _rows_of_the_state(loop: ClosedLoop, half_spaces: HalfSpaces, p: np.ndarray, state: LoopState) -> Rows:
    """Return the rows at p (n, 2) and xi [m], with the references applied in the tick before."""
    network, certificate = loop.network, cast(StateCertificate, loop.certificate)
    y, others = prediction_state(p, state.xi, state.motion)
    held = y.mean(axis=0) if state.m is None else network.leader @ state.m / network.leaders
    return certificate.rows_at(half_spaces, y, others, held)
