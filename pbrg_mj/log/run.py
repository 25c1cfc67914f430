"""A recorded run as arrays: what the analysis room works on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.scenario.schema import Scenario


@dataclass(frozen=True)
class TickSeries:
    """One row per tick; T ticks, n robots, K half-space slots per robot, R constraint rows per robot."""

    index: np.ndarray  # (T,) int64
    time: np.ndarray  # (T,) [s]
    body_pose_true: np.ndarray  # (T, n, 3) x, y [m], heading [rad]
    hand_true: np.ndarray  # (T, n, 2) q [m]
    wheel_speed: np.ndarray  # (T, n, 2) left, right [rad/s]
    wall_margin: np.ndarray  # (T, n) [m] truth: hand point to nearest wall's face, less the clearance
    wall_contact: np.ndarray  # (T, n) bool, truth
    body_pose: np.ndarray  # (T, n, 3) as the camera reports it
    hand: np.ndarray  # (T, n, 2) q from body_pose [m]
    pose_frame: np.ndarray  # (T,) int64
    scan_frame: np.ndarray  # (T,) int64
    half_space_G: np.ndarray  # (T, n, K, 2)
    half_space_h: np.ndarray  # (T, n, K) [m]
    half_space_active: np.ndarray  # (T, n, K) bool
    half_space_binds: np.ndarray  # (T, n, K, n) bool: which robots each must hold for
    p: np.ndarray  # (T, n, 2) [m]
    xi: np.ndarray  # (T, n, 2) [m]
    reference: np.ndarray  # (T, 2) the operator's r [m]
    m: np.ndarray  # (T, n, 2) governed references [m]
    multipliers: np.ndarray  # (T, n, R)
    status: np.ndarray  # (T,) str
    rounds: np.ndarray  # (T,) int64
    bytes_sent: np.ndarray  # (T, n) int64
    lost: np.ndarray  # (T, n) int64 neighbours each robot counts as lost
    storage: np.ndarray  # (T,) V at the leaders' m [m^2]
    storage_change: np.ndarray  # (T,) V less V a tick ago, at the m applied then [m^2]
    worst_row: np.ndarray  # (T,) largest row of g at the leaders' m [m]
    consensus_spread: np.ndarray  # (T,) [m]
    stationarity: np.ndarray  # (T,) KKT residual [m]
    complementarity: np.ndarray  # (T,) KKT residual [m^2]
    velocity: np.ndarray  # (T, n, 2) u [m/s]
    command: np.ndarray  # (T, n, 2) wheel voltages [V] or speeds [rad/s]; u [m/s] in the ideal plant
    winding_up: np.ndarray  # (T, n) bool: xi grows although the wheels do not follow u
    flow_primal_storage: np.ndarray  # (T,) of the flow's own velocity [m^2/s^2], NaN unless known
    flow_dual_storage: np.ndarray  # (T,) [m^2/s^2], NaN unless known
    flow_primal_dissipation: np.ndarray  # (T,) [m^2/s^3], >= 0: passive; NaN unless known
    flow_dual_dissipation: np.ndarray  # (T,) [m^2/s^3], >= 0: passive; NaN unless known


@dataclass(frozen=True)
class OptimumSeries:
    """One row per reference tick; S of them."""

    index: np.ndarray  # (S,) int64, the tick's index
    time: np.ndarray  # (S,) [s]
    m: np.ndarray  # (S, 2) m* [m], NaN unless solved
    cost: np.ndarray  # (S,) [m^2], NaN unless solved
    multipliers: np.ndarray  # (S, n, R), NaN unless solved
    status: np.ndarray  # (S,) str: solved, infeasible, failed
    solver_status: np.ndarray  # (S,) str
    primal_storage: np.ndarray  # (S,) [m^2], NaN unless known
    dual_storage: np.ndarray  # (S,) [m^2], NaN unless known
    primal_dissipation: np.ndarray  # (S,) [m^2/s], >= 0: passive; NaN unless known
    dual_dissipation: np.ndarray  # (S,) [m^2/s], >= 0: passive; NaN unless known


@dataclass(frozen=True)
class TimingSeries:
    """Wall-clock seconds per tick and stage; empty when the scenario switched timings off."""

    index: np.ndarray  # (T,) int64
    sense: np.ndarray
    perceive: np.ndarray
    govern: np.ndarray
    control: np.ndarray
    advance: np.ndarray
    certify: np.ndarray
    reference_build: np.ndarray
    reference_solve: np.ndarray
    reference_balance: np.ndarray


@dataclass(frozen=True)
class Run:
    """A log, read."""

    path: str
    name: str  # of the scenario
    scenario: Scenario
    scenario_yaml: str  # as run
    model_xml: str  # MJCF as run; empty for the ideal plant
    versions: dict[str, str]  # package name -> version, with python and platform
    ticks: TickSeries
    optima: OptimumSeries
    timings: TimingSeries
    damage: str | None  # why the file ends early, in one line; None for a complete log
