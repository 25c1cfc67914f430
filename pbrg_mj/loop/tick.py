"""One tick of the benchmark, in one direction.

physics -> raw ranges, raw poses -> readings -> half-spaces -> problem -> governor (rounds of messages)
-> governed references -> consensus control -> wheel voltages -> physics
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from time import perf_counter
from typing import Any

import numpy as np

from pbrg_mj.governor.certificate import Rows
from pbrg_mj.governor.operation import Operation, operation
from pbrg_mj.governor.optimum import CentralizedSolver, Optimum
from pbrg_mj.governor.passivity import Passivity
from pbrg_mj.governor.problem import Certificate, Governor, Problem
from pbrg_mj.loop.operator import operator_reference
from pbrg_mj.loop.record import TickRecord, Timings
from pbrg_mj.perception.perceive import PerceptionMemory, perceive
from pbrg_mj.perception.setup import PerceptionSetup
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.sensing.noise import SensorNoise
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.sensing.sense import sense
from pbrg_mj.team.network import Network
from pbrg_mj.team.pre_stabiliser import pre_stabilise
from pbrg_mj.team.wind_up import WindUp, WindUpRule, wind_up
from pbrg_mj.vehicle.drive import Drive
from pbrg_mj.vehicle.hand_point import hand_point
from pbrg_mj.world.interface import World


@dataclass(frozen=True)
class Parts:
    """What a run is made of; nothing here changes but the world inside `world`."""

    scenario: Scenario
    world: World
    noise: SensorNoise
    perception: PerceptionSetup
    network: Network
    formation: np.ndarray  # (n, 2) b [m]
    hand_offset: float  # [m]
    certificate: Certificate
    governor: Governor
    wind_up_rule: WindUpRule
    drive: Drive
    reference_solver: CentralizedSolver | None
    passivity: Callable[[Problem, Any, Optimum], Passivity]  # of the governor's own estimates, about an optimum
    flow_passivity: Callable[[Problem, Any], Passivity]  # of their own velocity
    reference_every: int  # ticks


@dataclass(frozen=True)
class State:
    """What one tick hands to the next, besides the world."""

    readings: Readings | None  # None before the first tick
    walls: PerceptionMemory
    rows: Rows | None  # of the half-spaces known then; likewise None before the first tick
    governor: Any  # likewise
    xi: np.ndarray  # (n, 2) [m]
    wind_up: WindUp | None  # likewise
    operation: Operation | None  # likewise


def tick(parts: Parts, state: State, index: int) -> tuple[State, TickRecord]:
    """Observe, decide, act and advance the world by one tick; return the next state and the record."""
    scenario = parts.scenario
    time = index * scenario.timing.tick
    stamps = [perf_counter()]

    truth = parts.world.truth()
    readings = sense(parts.world.observe(), state.readings, parts.noise)
    stamps.append(perf_counter())

    half_spaces, walls = perceive(readings, time, state.walls, parts.perception)
    stamps.append(perf_counter())

    rows = state.rows
    if rows is None or half_spaces is not state.walls.half_spaces:
        rows = parts.certificate.rows(half_spaces)
    hand_world = hand_point(readings.body_pose, parts.hand_offset)
    problem = Problem(
        network=parts.network,
        p=hand_world - parts.formation,
        xi=state.xi,
        rows=rows,
        reference=operator_reference(scenario.operator, time),
    )
    memory = parts.governor.init(problem) if state.governor is None else state.governor
    solution, memory = parts.governor.step(problem, memory)
    stamps.append(perf_counter())

    velocity, xi_rate = pre_stabilise(parts.network, scenario.control, problem.p, problem.xi, solution.m)
    followed = wind_up(parts.wind_up_rule, state.wind_up, problem.p, problem.xi, velocity)
    command = parts.drive.command(velocity, readings.body_pose)
    stamps.append(perf_counter())

    parts.world.advance(command)
    stamps.append(perf_counter())

    judged = operation(problem, solution, state.operation)
    flow = parts.flow_passivity(problem, memory)
    stamps.append(perf_counter())

    optimum = balance = None
    if parts.reference_solver is not None and index % parts.reference_every == 0:
        optimum = parts.reference_solver.solve(problem)
        balance = parts.passivity(problem, memory, optimum)
    stamps.append(perf_counter())

    timings = _timings(stamps, optimum)
    record = TickRecord(
        index=index,
        time=time,
        truth=truth,
        readings=readings,
        hand_world=hand_world,
        half_spaces=half_spaces,
        problem=problem,
        solution=solution,
        operation=judged,
        flow_passivity=flow,
        optimum=optimum,
        passivity=balance,
        velocity=velocity,
        command=command,
        winding_up=followed.winding,
        timings=timings,
    )
    xi = state.xi + scenario.timing.tick * xi_rate
    return State(readings, walls, rows, memory, xi, followed, judged), record


def _timings(stamps: list[float], optimum: Optimum | None) -> Timings:
    sense, perceive, govern, control, advance, certify, reference = (end - begin for begin, end in pairwise(stamps))
    build, solve = (optimum.build_seconds, optimum.solve_seconds) if optimum else (0.0, 0.0)
    return Timings(sense, perceive, govern, control, advance, certify, build, solve, reference - build - solve)
