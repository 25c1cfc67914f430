"""What a robot gives its optimizer, and what the optimizer offers."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from pbrg_mj.governor.certificate.scalar_reference_governor import Spread
from pbrg_mj.governor.messaging.program import OwnData, RobotFacts
from pbrg_mj.governor.problem.rows import Rows


class LocalProblem(NamedTuple):
    """What one robot alone knows of the problem."""

    own: OwnData  # of this tick
    reference: np.ndarray | None  # (2,) r_i of a leader [m]; None of other robots
    rows: Rows  # (1, R) of its own half-spaces at the last state of the team that it knows; R = 0 before
    spread: Spread  # of that state


class Optimizer(Protocol):
    """One object serves all robots; what differs between them is in facts, problem and memory.

    Iterations are synchronous: a robot takes one when it has the message of every neighbour's iteration before.
    """

    @property
    def numbers(self) -> int:
        """How many doubles a message has; 0: there are no messages and no iterations."""
        ...

    def start(self, facts: RobotFacts, local: LocalProblem) -> Any:
        """Return a robot's memory before the first iteration."""
        ...

    def message(self, memory: Any) -> np.ndarray:
        """Return what the robot tells every neighbour of its present iteration, (numbers,)."""
        ...

    def step_once(self, local: LocalProblem, memory: Any, received: np.ndarray) -> Any:
        """Return the memory after one iteration; `received` (neighbours, numbers), by neighbours ascending."""
        ...

    def candidate(self, local: LocalProblem, memory: Any) -> np.ndarray:
        """Return the m (2,) [m] that the robot would apply now."""
        ...


def cost_gradient(local: LocalProblem, m: np.ndarray) -> np.ndarray:
    """Return the gradient of delta_i ||r_i - m||^2, (2,)."""
    return np.zeros(2) if local.reference is None else 2.0 * (m - local.reference)


def no_rows() -> Rows:
    """Return the rows of a robot that knows of none, (1, 0)."""
    none = np.zeros((1, 0))
    return Rows(none, np.zeros((1, 0, 2)), none, none.astype(bool))
