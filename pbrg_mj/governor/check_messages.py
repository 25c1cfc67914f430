"""Whether robots know of each other by messages alone: all messages are lost, and one robot's data change."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from pbrg_mj.governor.messaging.networked import NetworkedGovernor
from pbrg_mj.governor.plug_in import PlugInGovernor
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.team.channel import Channel, Loss

CHANGE = 0.25  # [m] of one robot's p, xi, rows and reference
NEVER_LOST = 1 << 30  # rounds after which a neighbour would count as lost


def reactions_without_messages(
    title: str, made: Callable[[], PlugInGovernor], problems: Sequence[Problem]
) -> list[str]:
    """Return who answers otherwise when a leader's, or a follower's, own data change, though every message is lost."""
    team = problems[0].network
    found = []
    for leads in (1.0, 0.0):
        others = np.flatnonzero(team.leader == leads)
        if not len(others):
            continue
        changed = int(others[0])
        before, after = _answers(made, problems), _answers(made, [problems[0], *_changed(problems[1:], changed)])
        for robot in range(team.robots):
            received = robot == changed or bool(leads and team.leader[robot])  # all leaders get the operator's r
            if not received and not np.array_equal(before[:, robot], after[:, robot]):
                found.append(f"{title}: robot {robot + 1} answers to data of robot {changed + 1} without any message")
    return found


def _answers(made: Callable[[], PlugInGovernor], problems: Sequence[Problem]) -> np.ndarray:
    """Return m and bytes sent at every tick, (T, n, 3), while every message is lost."""
    governor, links = made().inner, len(problems[0].network.neighbours)
    if not isinstance(governor, NetworkedGovernor):
        raise TypeError("only programs of robots can be cut off from each other")
    silence = Channel(
        delay=np.zeros(links, dtype=np.int64),
        impedance=0.0,
        loss=Loss.independent(1.0),
        seed=0,
        outage_rounds=np.zeros((0, 3), dtype=np.int64),
        silent_after=NEVER_LOST,
    )
    governor = dataclasses.replace(governor, channel=silence)
    memory, found = governor.init(problems[0]), []
    for problem in problems:
        solution, memory = governor.step(problem, memory)
        found.append(np.column_stack([solution.m, solution.bytes_sent]))
    return np.array(found)


def _changed(problems: Sequence[Problem], robot: int) -> list[Problem]:
    return [_with_other_data(problem, robot) for problem in problems]


def _with_other_data(problem: Problem, robot: int) -> Problem:
    p, xi, rows, spaces = problem.p.copy(), problem.xi.copy(), problem.rows, problem.half_spaces
    p[robot] += CHANGE
    xi[robot] += CHANGE
    nearer, offsets = rows.d.copy(), None if spaces is None else spaces.h.copy()
    nearer[robot] -= CHANGE
    if spaces is not None and offsets is not None:
        offsets[robot] -= CHANGE
        spaces = dataclasses.replace(spaces, h=offsets)
    leads = problem.network.leader[robot] > 0.0
    return dataclasses.replace(
        problem,
        p=p,
        xi=xi,
        rows=Rows(rows.a, rows.C, nearer, rows.active),
        half_spaces=spaces,
        reference=problem.reference + CHANGE * leads,
    )
