"""The project's own messages, declared once: names, shapes, units, and where a record holds each value.

Dimensions: n robots, K half-space slots per robot, R constraint rows per robot. Field numbers follow the
order, so new fields go to the END of their message; any other change raises `SCHEMA_VERSION`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import prod
from typing import Literal

SCHEMA_VERSION = 1

Kind = Literal["double", "int", "bool", "text"]
Dims = dict[str, int]


@dataclass(frozen=True)
class Field:
    """One field of a message. `source` is the value's path in a TickRecord."""

    name: str
    source: str
    shape: tuple[str, ...]  # letters of Dims or numbers; () for a scalar
    unit: str
    meaning: str
    kind: Kind = "double"
    added: bool = False  # after the first version: earlier logs do not have it; arrays only, whose absence shows

    def extent(self, dims: Dims) -> tuple[int, ...]:
        """Return the shape in numbers, e.g. (5, 2) for ("n", "2")."""
        return tuple(dims[size] if size in dims else int(size) for size in self.shape)

    def count(self, dims: Dims) -> int:
        """Return the number of values, 1 for a scalar."""
        return prod(self.extent(dims))


INDEX = Field("index", "index", (), "-", "number of the tick, from 0", "int")
TIME = Field("time", "time", (), "s", "simulated time at the start of the tick")

TICK: tuple[Field, ...] = (
    INDEX,
    TIME,
    Field("body_pose_true", "truth.body_pose", ("n", "3"), "m, m, rad", "true x, y, heading of each body"),
    Field("hand_true", "truth.hand_world", ("n", "2"), "m", "true hand points q"),
    Field("wheel_speed", "truth.wheel_speed", ("n", "2"), "rad/s", "left, right; zeros in the ideal plant"),
    Field("wall_margin", "truth.wall_margin", ("n",), "m", "hand point to nearest face, less the clearance"),
    Field("wall_contact", "truth.wall_contact", ("n",), "-", "touched a wall since the last tick", "bool"),
    Field("body_pose", "readings.body_pose", ("n", "3"), "m, m, rad", "x, y, heading as the camera sees them"),
    Field("hand", "hand_world", ("n", "2"), "m", "hand points q from `body_pose`"),
    Field("pose_frame", "readings.pose_frame", (), "-", "frame of `body_pose`; -1 before the first", "int"),
    Field("scan_frame", "readings.scan_frame", (), "-", "scan of the half-spaces; -1 before the first", "int"),
    Field("half_space_G", "half_spaces.G", ("n", "K", "2"), "-", "unit normals of G q <= h; zeros if empty"),
    Field("half_space_h", "half_spaces.h", ("n", "K"), "m", "right-hand sides; zeros if empty"),
    Field("half_space_active", "half_spaces.active", ("n", "K"), "-", "the slot holds a half-space", "bool"),
    Field("half_space_binds", "half_spaces.binds", ("n", "K", "n"), "-", "whom it must hold for", "bool"),
    Field(
        "p",
        "problem.p",
        ("n", "2"),
        "m",
        "q - b as estimated, less the displacement by `control.separation`",
    ),
    Field("xi", "problem.xi", ("n", "2"), "m", "integral states of the pre-stabiliser"),
    Field("reference", "problem.reference", ("2",), "m", "the operator's reference r"),
    Field("m", "solution.m", ("n", "2"), "m", "governed reference as each robot knows it"),
    Field("multipliers", "solution.multipliers", ("n", "R"), "m", "lambda, one per constraint row"),
    Field("status", "solution.status", (), "-", "ok, or what the governor reports: docs/failure-modes.md", "text"),
    Field("rounds", "solution.rounds", (), "-", "communication rounds used", "int"),
    Field("bytes_sent", "solution.bytes_sent", ("n",), "bytes", "sent by each robot to its neighbours", "int"),
    Field("lost", "solution.lost", ("n",), "-", "neighbours each robot counts as lost", "int"),
    Field("storage", "operation.storage", (), "m^2", "V = rho^2 / 2 at the leaders' m"),
    Field("storage_change", "operation.storage_change", (), "m^2", "V less V a tick ago, at the m applied then"),
    Field("worst_row", "operation.worst_row", (), "m", "largest row of g at the leaders' m; > 0: no certificate"),
    Field("consensus_spread", "operation.consensus_spread", (), "m", "largest distance between two robots' m_i"),
    Field("stationarity", "operation.stationarity", (), "m", "KKT residual of the whole problem's gradient in m"),
    Field("complementarity", "operation.complementarity", (), "m^2", "KKT residual: largest lambda g, in size"),
    Field("velocity", "velocity", ("n", "2"), "m/s", "u of eq. 2, as velocity filters leave it"),
    Field(
        "command",
        "command",
        ("n", "2"),
        "V, rad/s or m/s",
        "by `drive.kind` wheel voltages or speeds; u in the ideal plant",
    ),
    Field("winding_up", "winding_up", ("n",), "-", "xi grows although the wheels do not follow u", "bool"),
    Field("flow_primal_storage", "flow_passivity.primal_storage", (), "m^2/s^2", "S of the flow's own velocity"),
    Field("flow_dual_storage", "flow_passivity.dual_storage", (), "m^2/s^2", "U of the flow's own velocity"),
    Field(
        "flow_primal_dissipation", "flow_passivity.primal_dissipation", (), "m^2/s^3", "supply - dS/dt; >= 0: passive"
    ),
    Field("flow_dual_dissipation", "flow_passivity.dual_dissipation", (), "m^2/s^3", "supply - dU/dt; >= 0: passive"),
    Field("moving_margin", "truth.moving_margin", ("n",), "m", "like `wall_margin`, to moving boxes", added=True),
    Field(
        "moving_contact", "truth.moving_contact", ("n",), "-", "touched a moving box since the last tick", "bool", True
    ),
    Field("robot_contact", "truth.robot_contact", ("n",), "-", "touched a robot since the last tick", "bool", True),
)

OPTIMUM: tuple[Field, ...] = (
    INDEX,
    TIME,
    Field("m", "optimum.m", ("2",), "m", "m* of the centralized solver; NaN unless solved"),
    Field("cost", "optimum.cost", (), "m^2", "leaders times squared distance of m* from r; NaN likewise"),
    Field("multipliers", "optimum.multipliers", ("n", "R"), "m", "lambda*, one per constraint row; NaN likewise"),
    Field("status", "optimum.status", (), "-", "solved, infeasible, failed", "text"),
    Field(
        "solver_status",
        "optimum.solver_status",
        (),
        "-",
        "in the solver's own words; OutOfRange: its optimum proves that nothing near the team is admissible",
        "text",
    ),
    Field("primal_storage", "passivity.primal_storage", (), "m^2", "S of consensus and descent about m*; NaN likewise"),
    Field("dual_storage", "passivity.dual_storage", (), "m^2", "U of the multipliers about lambda*; NaN likewise"),
    Field("primal_dissipation", "passivity.primal_dissipation", (), "m^2/s", "supply - dS/dt; >= 0: passive"),
    Field("dual_dissipation", "passivity.dual_dissipation", (), "m^2/s", "supply - dU/dt; >= 0: passive"),
)

TIMING: tuple[Field, ...] = (
    INDEX,
    Field("sense", "timings.sense", (), "s", "wall clock: reading the sensors"),
    Field("perceive", "timings.perceive", (), "s", "wall clock: scans to half-spaces"),
    Field("govern", "timings.govern", (), "s", "wall clock: the governor"),
    Field("control", "timings.control", (), "s", "wall clock: references to voltages"),
    Field("advance", "timings.advance", (), "s", "wall clock: the plant"),
    Field("certify", "timings.certify", (), "s", "wall clock: the truth and the certificates of operation"),
    Field("reference_build", "timings.reference_build", (), "s", "wall clock: building the reference"),
    Field("reference_solve", "timings.reference_solve", (), "s", "wall clock: solving it"),
    Field(
        "reference_balance",
        "timings.reference_balance",
        (),
        "s",
        "wall clock: reading it, passivity balance about it",
    ),
)

MESSAGES: dict[str, tuple[Field, ...]] = {"Tick": TICK, "Optimum": OPTIMUM, "Timing": TIMING}
