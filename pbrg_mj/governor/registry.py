"""Governors, certificates and solvers by the names a scenario calls them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from pbrg_mj import plugins
from pbrg_mj.errors import InputError
from pbrg_mj.governor.baselines import CentralizedGovernor, NoGovernor
from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.centralized.optimum import CentralizedSolver
from pbrg_mj.governor.centralized.within_range import WithinRange
from pbrg_mj.governor.certificate.by_name import CERTIFICATES, margin
from pbrg_mj.governor.certificate.team_model import MOST_TICKS, UnsettledTeamError
from pbrg_mj.governor.certified.advance_limits import speed_facets
from pbrg_mj.governor.certified.from_scenario import certified
from pbrg_mj.governor.distributed.from_scenario import flow, paper_flow
from pbrg_mj.governor.messaging.networked import NetworkedGovernor
from pbrg_mj.governor.paper_program import PaperProgram
from pbrg_mj.governor.plug_in import PlugInCertificate, PlugInGovernor, PlugInSolver
from pbrg_mj.governor.plug_in_program import robots_of_scenario
from pbrg_mj.governor.problem.interface import Certificate, Governor, StateCertificate
from pbrg_mj.governor.rollout.governor import RolloutGovernor
from pbrg_mj.governor.rollout.plan import RolloutPlan
from pbrg_mj.governor.rollout.robot import RolloutProgram
from pbrg_mj.governor.velocity_filter.barrier import BarrierFilter
from pbrg_mj.governor.velocity_filter.interface import VelocityFilter
from pbrg_mj.governor.velocity_filter.potential_field import PotentialField
from pbrg_mj.governor.velocity_filter.separation import SeparationFilter, separation
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.channel import channel
from pbrg_mj.team.graph import network
from pbrg_mj.vehicle.motor_lag import motor_lag


def _cvxpy() -> CentralizedSolver:
    from pbrg_mj.governor.centralized.cvxpy_solver import CvxpySolver  # takes a second to import

    return CvxpySolver()


SOLVERS: dict[str, Callable[[], CentralizedSolver]] = {"clarabel": ClarabelSolver, "cvxpy": _cvxpy}


def _distributed(scenario: Scenario) -> Governor:
    if scenario.governor.backend == "program":
        return _paper_program(scenario)
    return paper_flow(scenario, channel(scenario))


def _paper_program(scenario: Scenario) -> Governor:
    settings, lines = scenario.governor, channel(scenario)
    beyond = scenario.divergence_limit
    program = PaperProgram.of(flow(scenario), settings.reference_range, beyond, network(scenario), lines)
    return replace(NetworkedGovernor.of(scenario, program), shares_rows=True)  # rows of rho, or along G, are its own


def _rollout(scenario: Scenario, *, vectorized: bool = True) -> Governor:
    lines, rounds = channel(scenario), scenario.governor.rounds
    plan = RolloutPlan.of(scenario, network(scenario), margin(scenario), lines)
    if vectorized and lines is None:
        return RolloutGovernor(plan, rounds)
    return NetworkedGovernor(RolloutProgram(plan), rounds, lines)


GOVERNORS: dict[str, Callable[[Scenario], Governor]] = {
    "distributed": _distributed,
    "certified": certified,
    "rollout": _rollout,
    "centralized": lambda scenario: CentralizedGovernor(WithinRange(ClarabelSolver())),
    "none": lambda scenario: NoGovernor(),
    "cbf": lambda scenario: NoGovernor(),  # `velocity_filters` does what is done
    "potential_field": lambda scenario: NoGovernor(),  # likewise
}


def governor(scenario: Scenario, given: Any = None) -> Governor:
    """Return the scenario's governor: one of ours, one of an installed package, or the object `given`.

    Raises InputError for an unknown name and wrong options, PlugInError when a plug-in cannot be built.
    """
    if given is None and scenario.governor.kind in GOVERNORS:
        with _foreseen(scenario):
            return GOVERNORS[scenario.governor.kind](scenario)
    if not plugins.is_centralized(scenario.governor.kind, given):
        return robots_of_scenario(scenario, given)
    name, built = plugins.build(plugins.GOVERNOR, scenario, given, network=network(scenario))
    return PlugInGovernor(built, name, scenario.timing.plug_in_limit)


PROGRAMS: dict[str, Callable[[Scenario], Any]] = {
    "distributed": _paper_program,
    "certified": lambda scenario: certified(scenario, vectorized=False),
    "rollout": lambda scenario: _rollout(scenario, vectorized=False),
}


def robot_programs(scenario: Scenario) -> NetworkedGovernor:
    """Return the scenario's governor as a program of every robot, never computed for all of them at once.

    Raises InputError where it is none, PlugInError when a plug-in cannot be built.
    """
    kind = scenario.governor.kind
    if kind in PROGRAMS:
        with _foreseen(scenario):
            return PROGRAMS[kind](scenario)
    if plugins.is_centralized(kind) or kind in GOVERNORS:
        allowed = f"allowed: {', '.join(PROGRAMS)}, or a robot program of an installed package"
        raise InputError(f"is {kind}, which robots do not run themselves; {allowed}", key="governor.kind")
    return robots_of_scenario(scenario).inner


@contextmanager
def _foreseen(scenario: Scenario) -> Iterator[None]:
    """Turn a team that takes too long to settle for a certificate into an InputError."""
    try:
        yield
    except UnsettledTeamError:
        if (lag := motor_lag(scenario)) is not None:
            late = f"motors, and behind {lag.time_constant:.3g} s of lag and {lag.delay} ticks of delay the team does"
            allowed = "allowed: kinematic, or shorter delays"
            raise InputError(f"is {late} not settle; {allowed}", key="governor.predicted_motion") from None
        slow = f"is {scenario.control.alpha_r}, with which the team does not settle in the {MOST_TICKS} ticks that"
        raise InputError(f"{slow} certificates foresee; allowed: a larger one", key="control.alpha_r") from None


def velocity_filters(scenario: Scenario) -> tuple[VelocityFilter, ...]:
    """Return what changes the velocities of eq. 2 in a scenario, in this order."""
    settings = scenario.governor
    filters: list[VelocityFilter] = []
    if settings.kind == "cbf":
        filters.append(BarrierFilter(settings.barrier_gain, margin(scenario)))
    elif settings.kind == "potential_field":
        filters.append(PotentialField(settings.field_gain, settings.field_range, scenario.timing.tick))
    if separation(scenario) is not None:
        filters.append(SeparationFilter.of(scenario, margin(scenario), speed_facets(scenario, wheels=True)))
    return tuple(filters)


def certificate(scenario: Scenario, given: Any = None) -> Certificate | StateCertificate:
    """Return the scenario's certificate; arguments and errors are those of `governor`."""
    graph = network(scenario)
    if given is None and scenario.governor.certificate in CERTIFICATES:
        with _foreseen(scenario):
            return CERTIFICATES[scenario.governor.certificate](scenario, graph)
    name, built = plugins.build(plugins.CERTIFICATE, scenario, given, network=graph)
    return PlugInCertificate(built, name, scenario.timing.plug_in_limit)


def reference_solver(scenario: Scenario, given: Any = None) -> CentralizedSolver | None:
    """Return the solver of the centralized reference, None where the scenario switched it off; likewise."""
    if given is None and scenario.reference.solver in SOLVERS:
        return WithinRange(SOLVERS[scenario.reference.solver]())
    if given is None and scenario.reference.solver == "none":
        return None
    name, built = plugins.build(plugins.REFERENCE_SOLVER, scenario, given, network=network(scenario))
    return WithinRange(PlugInSolver(built, name, scenario.timing.plug_in_limit))
