"""Synthetic runs with planted values."""

from __future__ import annotations

from dataclasses import replace as replaced
from typing import Any

import numpy as np

from pbrg_mj.log.read.run import OptimumSeries, Run, TickSeries, TimingSeries
from pbrg_mj.scenario.schema import Scenario

FORMATION = ((0.0, 0.0), (0.0, -1.0))
GIVEN = ({"robot": 1, "normal": (1.0, 0.0), "offset": 2.0},)
WALL = {"from": (2.25, -5.0), "to": (2.25, 5.0), "thickness": 0.1}


def scenario(**changes: Any) -> Scenario:
    """Two robots, the second leads; r = (1, 0); the half-space x <= 2 given; ticks of 0.5 s."""
    data: dict[str, Any] = {
        "plant": "ideal",
        "timing": {"duration": 10.0, "tick": 0.5, "physics_step": 0.5},
        "team": {"start": ((0.0, 0.0), (0.0, -1.0)), "formation": FORMATION, "leaders": (2,)},
        "graph": {"kind": "path"},
        "estimator": {"source": "given", "given": GIVEN, "half_spaces_per_robot": 1},
        "operator": {"reference": (1.0, 0.0)},
    }
    return Scenario.model_validate(data | changes)


def walled(**changes: Any) -> Scenario:
    """The same team before a wall whose face is x = 2.2, in physics, seen by beams."""
    return scenario(plant="physics", world={"walls": (WALL,)}, estimator={}, **changes)


def run(plan: Scenario | None = None, *, ticks: dict[str, Any] | None = None, **changes: Any) -> Run:
    """A run of 21 ticks at rest at the target (1, 0), m = m* = r, references solved at every fourth tick."""
    plan = plan or scenario()
    made = Run(
        path="run.mcap",
        name="planted",
        scenario=plan,
        scenario_yaml="seed: 1\n",
        model_xml="",
        versions={"python": "3.11"},
        ticks=replaced(resting(plan), **(ticks or {})),
        optima=optima(plan),
        timings=timings(),
        damage=None,
    )
    return replaced(made, **changes)


def resting(plan: Scenario, steps: int = 21) -> TickSeries:
    n, r = plan.robots, np.array(plan.operator.reference)
    q = np.broadcast_to(r + np.array(plan.team.formation), (steps, n, 2)).copy()
    pose = np.concatenate([q, np.zeros((steps, n, 1))], axis=2)
    G = np.zeros((steps, n, 1, 2))
    G[:, 0, 0] = (1.0, 0.0)
    return TickSeries(
        index=np.arange(steps),
        time=0.5 * np.arange(steps),
        body_pose_true=pose,
        hand_true=q,
        wheel_speed=np.zeros((steps, n, 2)),
        wall_margin=np.full((steps, n), 1.0),
        wall_contact=np.zeros((steps, n), dtype=bool),
        body_pose=pose.copy(),
        hand=q.copy(),
        pose_frame=np.arange(steps),
        scan_frame=np.arange(steps),
        half_space_G=G,
        half_space_h=2.0 * G[..., 0],
        half_space_active=G[..., 0] > 0,
        half_space_binds=np.broadcast_to((G[..., 0] > 0)[..., None], (steps, n, 1, n)).copy(),
        p=np.broadcast_to(r, (steps, n, 2)).copy(),
        xi=np.zeros((steps, n, 2)),
        reference=np.broadcast_to(r, (steps, 2)).copy(),
        m=np.broadcast_to(r, (steps, n, 2)).copy(),
        multipliers=np.zeros((steps, n, n)),
        status=np.full(steps, "ok"),
        rounds=np.full(steps, 10),
        bytes_sent=np.full((steps, n), 480),
        lost=np.zeros((steps, n), dtype=np.int64),
        storage=np.zeros(steps),
        storage_change=np.zeros(steps),
        worst_row=np.full(steps, -1.0),
        consensus_spread=np.zeros(steps),
        stationarity=np.zeros(steps),
        complementarity=np.zeros(steps),
        velocity=np.zeros((steps, n, 2)),
        command=np.zeros((steps, n, 2)),
        winding_up=np.zeros((steps, n), dtype=bool),
        flow_primal_storage=np.zeros(steps),
        flow_dual_storage=np.zeros(steps),
        flow_primal_dissipation=np.zeros(steps),
        flow_dual_dissipation=np.zeros(steps),
        moving_margin=np.full((steps, n), np.inf),
        moving_contact=np.zeros((steps, n), dtype=bool),
        robot_contact=np.zeros((steps, n), dtype=bool),
    )


def optima(plan: Scenario, steps: int = 21) -> OptimumSeries:
    index = np.arange(0, steps, 4)
    return OptimumSeries(
        index=index,
        time=0.5 * index,
        m=np.tile(np.array(plan.operator.reference), (len(index), 1)),
        cost=np.zeros(len(index)),
        multipliers=np.zeros((len(index), plan.robots, plan.robots)),
        status=np.full(len(index), "solved", dtype="<U10"),
        solver_status=np.full(len(index), "optimal"),
        primal_storage=np.zeros(len(index)),
        dual_storage=np.zeros(len(index)),
        primal_dissipation=np.zeros(len(index)),
        dual_dissipation=np.zeros(len(index)),
    )


def timings(steps: int = 21) -> TimingSeries:
    """0.01 s a stage and tick; the reference solved at every fourth tick in 0.02 s built, 0.03 s solved."""
    stage = np.full(steps, 0.01)
    solved = np.arange(steps) % 4 == 0
    reference = (np.where(solved, 0.02, 0.0), np.where(solved, 0.03, 0.0))
    return TimingSeries(np.arange(steps), *[stage] * 6, *reference, np.zeros(steps))
