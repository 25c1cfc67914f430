"""From pose estimates and half-spaces to wheel voltages in many worlds at once: governor and control, compiled."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from pbrg_mj.errors import InputError
from pbrg_mj.governor.certificate.predictive import PredictiveCertificate
from pbrg_mj.governor.certified.compiled import CompiledDecision, write_predicted_next
from pbrg_mj.governor.certified.governor import CertifiedGovernor
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.governor.distributed.rounds import check_limits, rounds_in_new_arrays
from pbrg_mj.governor.problem.interface import Certificate, Problem, StateCertificate
from pbrg_mj.governor.problem.near_reference import write_near_references
from pbrg_mj.governor.problem.rows import Rows
from pbrg_mj.governor.registry import certificate, governor
from pbrg_mj.kernel import kernel
from pbrg_mj.loop.batch_team import TeamStates, control_of_teams, control_world, write_places
from pbrg_mj.loop.compiled_control import CompiledControl
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Scenario


class BatchControl(Protocol):
    """Governor and control of W worlds."""

    team: CompiledControl
    states: TeamStates

    def learn(self, world: int, half_spaces: HalfSpaces) -> None:
        """Take note of a world's new half-spaces."""
        ...

    def initialise(self, reference: np.ndarray) -> None:
        """Take the governor's first estimates in every world, from the poses known by now."""
        ...

    def step(self, reference: np.ndarray) -> None:
        """Bring m, xi and commands of all worlds to the next tick."""
        ...


def batch_control(scenario: Scenario, half_spaces: HalfSpaces) -> BatchControl:
    """Return a scenario's; `half_spaces` are those of all worlds, which the caller keeps up to date.

    Raises InputError for what is not compiled for worlds side by side.
    """
    if scenario.governor.predicted_motion != "kinematic":
        raise InputError("a batch predicts kinematic robots; run the seeds one by one", key="governor.predicted_motion")
    chosen, rows = governor(scenario), certificate(scenario)
    if isinstance(chosen, DistributedGovernor) and chosen.channel is None and chosen.backend == "compiled":
        if isinstance(rows, StateCertificate):
            raise InputError("a batch has rows of the ball alone; run the seeds one by one", key="governor.certificate")
        return DistributedBatch(
            control_of_teams(scenario), chosen, rows, scenario.governor.reference_range, half_spaces
        )
    decision = chosen.compiled if isinstance(chosen, CertifiedGovernor) else None
    if decision is not None and isinstance(decision.certificate, PredictiveCertificate):
        return CertifiedBatch(control_of_teams(scenario), decision, decision.certificate, half_spaces)
    only = "a batch runs the distributed governor, or the certified one by prediction, without delay, loss or outage"
    raise InputError(f"{only}; run the seeds one by one", key="governor")


class DistributedBatch:
    """The paper's governor in W worlds."""

    def __init__(
        self,
        team: CompiledControl,
        chosen: DistributedGovernor,
        rows: Certificate,
        reference_range: float,
        half_spaces: HalfSpaces,
    ):
        """Begin with no estimates."""
        worlds, n = len(half_spaces.h), team.network.robots
        self.team, self.states = team, TeamStates.initial(worlds, n)
        self._governor, self._certificate, self._reference_range = chosen, rows, reference_range
        self._spaces = half_spaces.arrays
        known = rows.rows(HalfSpaces(*(array[0] for array in self._spaces)))
        self._rows = tuple(np.stack([array] * worlds) for array in known)  # of Rows, worlds first
        widths = (4 * n + 2, 4 * n + 2, known.d.shape[1], 4)
        self._estimates = tuple(np.zeros((worlds, n, width)) for width in widths)  # z, zeta, lam, nu, worlds first

    def learn(self, world: int, half_spaces: HalfSpaces) -> None:
        """Set a world's new rows."""
        for array, value in zip(self._rows, self._certificate.rows(half_spaces), strict=True):
            array[world] = value

    def initialise(self, reference: np.ndarray) -> None:
        """Take the governor's first estimates."""
        states, reach = self.states, self._reference_range
        for world, p in enumerate(states.p(self.team)):
            rows = Rows(*(array[world] for array in self._rows))
            problem = Problem(self.team.network, p, states.xi[world], rows, reference, reference_range=reach)
            memory = self._governor.init(problem)
            first = memory.estimates
            for array, value in zip(self._estimates, (first.z, first.zeta, first.lam, first.nu), strict=True):
                array[world] = value
            states.m[world], states.diverged[world] = memory.m, memory.diverged

    def step(self, reference: np.ndarray) -> None:
        """Do the tick's rounds, then control."""
        _step_distributed(
            self.states.arrays,
            self._spaces,
            self._estimates,
            self._rows,
            (reference, self._reference_range),
            (tuple(self._governor.flow), self._governor.rounds, self._governor.diverged_beyond),
            self.team.packed,
        )


class CertifiedBatch:
    """The certified governor in W worlds, with messages that arrive within their round."""

    def __init__(
        self, team: CompiledControl, decision: CompiledDecision, rows: PredictiveCertificate, half_spaces: HalfSpaces
    ):
        """Begin with nothing held."""
        worlds = len(half_spaces.h)
        self.team, self.states = team, TeamStates.initial(worlds, team.network.robots)
        self._held = np.zeros((worlds, 2))  # [m]
        self._spaces = half_spaces.arrays
        self._decision = rows.packed, decision.limits

    def learn(self, world: int, half_spaces: HalfSpaces) -> None:
        """Do nothing: it decides by the half-spaces themselves."""

    def initialise(self, reference: np.ndarray) -> None:
        """Hold what `CertifiedGovernor.init` does."""
        self._held[:] = [p.mean(axis=0) for p in self.states.p(self.team)]

    def step(self, reference: np.ndarray) -> None:
        """Decide, then control."""
        _step_certified(self.states.arrays, self._spaces, self._held, reference, self._decision, self.team.packed)


@kernel
def _step_distributed(states, half_spaces, estimates, rows, operator, governor, team):
    """Do for each of the worlds what `tick` does between perception and physics, with the paper's governor.

    `estimates` (four arrays, W first) are those of `Estimates`, `rows` (five arrays, W first) those of `Rows`;
    `operator` the reference r (2,) and its reach [m]; `governor` the gains (numbers, in order) of `Flow`, rounds a tick
    and beyond which bound estimates have diverged; `team` (a tuple, as above) is `CompiledControl.packed`.
    """
    pose, xi, displacement, m, diverged, _ = states
    (r, reach), (gains, rounds, beyond) = operator, governor
    graph, shape = team[0], team[1].shape
    q, p, near = np.empty(shape), np.empty(shape), np.empty(shape)
    for w in range(len(pose)):
        write_places(pose[w], displacement[w], team, q, p)
        write_near_references(p, r, reach, near)
        before = (estimates[0][w], estimates[1][w], estimates[2][w], estimates[3][w])
        own_rows = (rows[0][w], rows[1][w], rows[2][w], rows[3][w], rows[4][w])
        after = rounds_in_new_arrays(before, graph, (p, xi[w], near), own_rows, gains, 0 if diverged[w] else rounds)
        estimates[0][w], estimates[1][w], estimates[2][w], estimates[3][w] = after
        diverged[w] = not check_limits(after[0], after[2], beyond, gains[2])[0]
        if not diverged[w]:
            m[w] = after[0][:, :2]
        control_world(w, states, (q, p), half_spaces, False, team)


@kernel
def _step_certified(states, half_spaces, held, r, decision, team):
    """Do the same with the certified governor.

    `held` (W, 2) [m] are the references held, r (2,) [m] the operator's; `decision` is certificate and limits as for
    `write_predicted_next`; `team` (a tuple, as above) is `CompiledControl.packed`.
    """
    pose, xi, displacement, m, _, _ = states
    G, h, active, binds, _, _ = half_spaces
    (certificate, limits), shape = decision, team[1].shape
    q, p = np.empty(shape), np.empty(shape)
    for w in range(len(pose)):
        write_places(pose[w], displacement[w], team, q, p)
        spaces, state = (G[w], h[w], active[w], binds[w]), (p, xi[w], pose[w][:, 2], held[w], r)
        status, _ = write_predicted_next(spaces, state, certificate, limits, m[w])
        held[w, 0], held[w, 1] = m[w, 0, 0], m[w, 0, 1]
        control_world(w, states, (q, p), half_spaces, status > 0, team)
