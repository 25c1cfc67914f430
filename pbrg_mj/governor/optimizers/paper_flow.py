"""The paper's flow (eqs. 16-30) as the optimizer of one robot, by `distributed.equations`.

It needs no state but its own: those of the others are part of what it estimates, and its rows are eq. 13 at them. So it
sends 2 (4n + 2) numbers where the others send two or four.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.distributed.equations import Estimate, Message, robot_round
from pbrg_mj.governor.distributed.equations import LocalProblem as OwnProblem
from pbrg_mj.governor.distributed.estimates import Flow
from pbrg_mj.governor.messaging.program import RobotFacts
from pbrg_mj.governor.optimizers.interface import LocalProblem
from pbrg_mj.governor.problem.ball import BallCertificate


class PaperMemory(NamedTuple):
    """What one robot remembers."""

    facts: RobotFacts
    z: np.ndarray  # (4n + 2,)
    zeta: np.ndarray  # (4n + 2,)
    lam: np.ndarray  # (R,) multipliers of all its rows, 0 where there is none
    nu: np.ndarray  # (4,)


@dataclass(frozen=True)
class PaperFlow:
    """The flow's parameters and the rows of its problem."""

    flow: Flow
    certificate: BallCertificate
    robots: int  # n

    @property
    def numbers(self) -> int:
        """How many doubles a message has: z and zeta."""
        return 2 * (4 * self.robots + 2)

    def start(self, facts: RobotFacts, local: LocalProblem) -> PaperMemory:
        """Return first estimates: all zero, or where every start is known, m_i = p_i(0), z_p = p(0), z_xi = 0."""
        z = np.zeros(4 * self.robots + 2)
        if facts.start is not None:
            z[:2] = local.own.p
            z[2 : 2 * self.robots + 2] = facts.start.reshape(-1)
        rows = self.certificate.rows_of(facts.robot, local.own.half_spaces)
        return PaperMemory(facts, z, np.zeros_like(z), np.zeros(rows.d.shape[1]), np.zeros(4))

    def message(self, memory: PaperMemory) -> np.ndarray:
        """Return z_i and zeta_i."""
        return np.concatenate([memory.z, memory.zeta])

    def step_once(self, local: LocalProblem, memory: PaperMemory, received: np.ndarray) -> PaperMemory:
        """Return the memory after one round."""
        i, n, own = memory.facts.robot, self.robots, local.own
        rows = self.certificate.rows_of(i, own.half_spaces)
        active = rows.active[0]
        problem = OwnProblem(
            leads=0.0 if local.reference is None else 1.0,
            reference=np.zeros(2) if local.reference is None else local.reference,
            state=np.concatenate([own.p, own.xi]),
            pinned=np.array([2 + 2 * i, 3 + 2 * i, 2 + 2 * n + 2 * i, 3 + 2 * n + 2 * i]),
            a=rows.a[0, active],
            C=rows.C[0, active],
            d=rows.d[0, active],
        )
        messages = [Message(*np.split(one, 2)) for one in received]
        before = Estimate(memory.z, memory.zeta, memory.lam[active], memory.nu)
        after = robot_round(problem, before, messages, self.flow)
        lam = np.zeros_like(memory.lam)
        lam[active] = after.lam
        return PaperMemory(memory.facts, after.z, after.zeta, lam, after.nu)

    def candidate(self, local: LocalProblem, memory: PaperMemory) -> np.ndarray:
        """Return m_i."""
        return memory.z[:2]
