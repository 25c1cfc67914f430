"""Governors, certificates and solvers by the names a scenario calls them."""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib.metadata import entry_points

from pbrg_mj.errors import InputError
from pbrg_mj.governor.baselines import CentralizedGovernor, NoGovernor
from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.centralized.optimum import CentralizedSolver
from pbrg_mj.governor.distributed.channel import channel
from pbrg_mj.governor.distributed.estimates import Flow
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.governor.guard import GuardedGovernor
from pbrg_mj.governor.plug_in import PlugInGovernor
from pbrg_mj.governor.problem.ball import BallCertificate
from pbrg_mj.governor.problem.interface import Certificate, Governor
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.network import Network

GROUP = "pbrg_mj.governors"
"""Entry-point group in which another installed package offers its own governor: name -> (Scenario) -> Governor."""

OBJECT = "object:"
"""What `governor.kind` begins with where the governor is an object handed over in Python."""

CERTIFICATES: dict[str, Callable[[Scenario, Network], Certificate]] = {"ball": BallCertificate.of}


def _cvxpy() -> CentralizedSolver:
    from pbrg_mj.governor.centralized.cvxpy_solver import CvxpySolver  # takes a second to import

    return CvxpySolver()


SOLVERS: dict[str, Callable[[], CentralizedSolver]] = {"clarabel": ClarabelSolver, "cvxpy": _cvxpy}


def round_step(scenario: Scenario) -> float:
    """Return the step of one communication round [s]: as given, or so that the rounds of a tick cover the tick."""
    settings = scenario.governor
    return scenario.timing.tick / settings.rounds if settings.step is None else settings.step


def _distributed(scenario: Scenario) -> Governor:
    settings = scenario.governor
    cap = math.inf if settings.multiplier_cap is None else settings.multiplier_cap
    optimizer = DistributedGovernor(
        flow=Flow(settings.alpha, round_step(scenario), cap),
        rounds=settings.rounds,
        initial=settings.initial,
        channel=channel(scenario),
        diverged_beyond=scenario.outcome.diverged_beyond,
        backend=settings.backend,
    )
    return GuardedGovernor(optimizer) if settings.guard else optimizer


GOVERNORS: dict[str, Callable[[Scenario], Governor]] = {
    "distributed": _distributed,
    "centralized": lambda scenario: CentralizedGovernor(ClarabelSolver()),
    "none": lambda scenario: NoGovernor(),
}


def object_kind(plug_in: Governor) -> str:
    """Return what `governor.kind` says of a run whose governor is an object: `object:` and the name of its class."""
    return OBJECT + type(plug_in).__name__


def governor(scenario: Scenario, plug_in: Governor | None = None) -> Governor:
    """Return the scenario's governor: one of ours, one that an installed package registered, or the object `plug_in`.

    Raises InputError when nobody knows the name, or the object is missing.
    """
    kind = scenario.governor.kind
    if plug_in is not None:
        return PlugInGovernor(plug_in)
    if kind.startswith(OBJECT):
        name = kind.removeprefix(OBJECT)
        hand_over = "hand it to pbrg_mj.run or pbrg_mj.verify as `governor`"
        raise InputError(
            f"the governor was an object of the class {name} in a Python program; {hand_over}", key="governor.kind"
        )
    if kind in GOVERNORS:
        return GOVERNORS[kind](scenario)
    registered = {entry.name: entry for entry in entry_points(group=GROUP)}
    if kind not in registered:
        known = ", ".join([*GOVERNORS, *sorted(registered)])
        raise InputError(f"no governor is called {kind!r}; allowed: {known}", key="governor.kind")
    return PlugInGovernor(registered[kind].load()(scenario))


def reference_solver(scenario: Scenario) -> CentralizedSolver | None:
    """Return the solver of the centralized reference, or None where the scenario switched it off."""
    return None if scenario.reference.solver == "none" else SOLVERS[scenario.reference.solver]()
