"""Governors, certificates and solvers by the names a scenario calls them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from pbrg_mj import plugins
from pbrg_mj.errors import InputError
from pbrg_mj.governor.baselines import CentralizedGovernor, NoGovernor
from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.centralized.optimum import CentralizedSolver
from pbrg_mj.governor.certificate.advances import AdvanceCertificate
from pbrg_mj.governor.certificate.ball import BallAtState
from pbrg_mj.governor.certificate.directional_ball import DirectionalBall
from pbrg_mj.governor.certificate.prediction_grid import PredictionGrid
from pbrg_mj.governor.certificate.predictive import PredictiveCertificate
from pbrg_mj.governor.certificate.sight import SightLimit, sight
from pbrg_mj.governor.certificate.speed import UNLIMITED, SpeedLimit, disc_facets, turning_offset, wheel_facets
from pbrg_mj.governor.certificate.steering import mean_delay, steerable_speed
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.certified.at_once import LayerGovernor, Schedule
from pbrg_mj.governor.certified.compiled import CompiledDecision
from pbrg_mj.governor.certified.cycles import CycleGovernor
from pbrg_mj.governor.certified.decide import AdvanceLimit
from pbrg_mj.governor.certified.governor import CertifiedGovernor
from pbrg_mj.governor.certified.layer import LayerProgram
from pbrg_mj.governor.certified.robot import CertifiedProgram, repeats_for
from pbrg_mj.governor.distributed.estimates import Flow
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.governor.distributed.penalty import exact_multiplier_cap
from pbrg_mj.governor.messaging.carrier import CarriedGovernor
from pbrg_mj.governor.optimizers.by_name import OPTIMIZERS
from pbrg_mj.governor.optimizers.synchronizer import Synchronizer
from pbrg_mj.governor.optimizers.team import CompiledPaperFlow, EveryRobot
from pbrg_mj.governor.paper_program import PaperProgram
from pbrg_mj.governor.plug_in import PlugInCertificate, PlugInGovernor, PlugInSolver
from pbrg_mj.governor.plug_in_program import robots_of_scenario
from pbrg_mj.governor.problem.ball import BallCertificate
from pbrg_mj.governor.problem.directional_ball import DirectionalBallCertificate
from pbrg_mj.governor.problem.interface import Certificate, Governor, StateCertificate
from pbrg_mj.governor.rollout.governor import RolloutGovernor
from pbrg_mj.governor.rollout.plan import RolloutPlan
from pbrg_mj.governor.rollout.robot import RolloutProgram
from pbrg_mj.governor.velocity_filter.barrier import BarrierFilter
from pbrg_mj.governor.velocity_filter.interface import VelocityFilter
from pbrg_mj.governor.velocity_filter.potential_field import PotentialField
from pbrg_mj.governor.velocity_filter.separation import SeparationFilter, separation
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.channel import Channel, channel
from pbrg_mj.team.graph import network
from pbrg_mj.team.network import Network
from pbrg_mj.world.scene.robot import load_robot_model

CERTIFICATES: dict[str, Callable[[Scenario, Network], Certificate | StateCertificate]] = {
    "ball": BallCertificate.of,
    "directional_ball": lambda scenario, team: _directional_ball(scenario, team),
    "predictive": lambda scenario, team: PredictiveCertificate.of(scenario, margin(scenario)),
}
CERTIFICATE_KEY = "governor.certificate"
DEFAULT_MARGIN = 0.01  # [m] in physics, for what the linear model leaves out: docs/certified.md


def _directional_ball(scenario: Scenario, team: Network) -> Certificate | StateCertificate:
    """Return rows of the norm for the paper's flow, whose robots estimate the state; for all else the intervals."""
    if scenario.governor.kind == "distributed":
        return DirectionalBallCertificate.of(scenario, team, margin(scenario))
    return DirectionalBall.of(scenario, margin(scenario))


def _cvxpy() -> CentralizedSolver:
    from pbrg_mj.governor.centralized.cvxpy_solver import CvxpySolver  # takes a second to import

    return CvxpySolver()


SOLVERS: dict[str, Callable[[], CentralizedSolver]] = {"clarabel": ClarabelSolver, "cvxpy": _cvxpy}


def margin(scenario: Scenario) -> float:
    """Return what certificates keep from half-spaces [m]: as given, or what suits the plant."""
    given = scenario.governor.margin
    if given is not None:
        return given
    return DEFAULT_MARGIN if scenario.plant == "physics" else 0.0


def round_step(scenario: Scenario) -> float:
    """Return the step of one communication round [s]: as given, or so that the rounds of a tick cover the tick."""
    settings = scenario.governor
    return scenario.timing.tick / settings.rounds if settings.step is None else settings.step


def multiplier_cap(scenario: Scenario) -> float:
    """Return mu [m]: as given, inf for null, or for `auto` so large that the penalty is exact (`penalty`)."""
    settings = scenario.governor
    if settings.multiplier_cap == "auto":
        return exact_multiplier_cap(scenario.robots, len(scenario.team.leaders), settings.reference_range)
    return math.inf if settings.multiplier_cap is None else settings.multiplier_cap


def _flow(scenario: Scenario) -> Flow:
    return Flow(scenario.governor.alpha, round_step(scenario), multiplier_cap(scenario))


def _paper_flow(scenario: Scenario, lines: Channel | None) -> DistributedGovernor:
    settings = scenario.governor
    return DistributedGovernor(
        flow=_flow(scenario),
        rounds=settings.rounds,
        initial=settings.initial,
        channel=lines,
        diverged_beyond=scenario.outcome.diverged_beyond,
        backend="numpy" if settings.backend == "numpy" else "compiled",
    )


def _distributed(scenario: Scenario) -> Governor:
    if scenario.governor.backend == "program":
        return _paper_program(scenario)
    return _paper_flow(scenario, channel(scenario))


def _paper_program(scenario: Scenario) -> Governor:
    settings, lines = scenario.governor, channel(scenario)
    beyond = scenario.outcome.diverged_beyond
    program = PaperProgram.of(_flow(scenario), settings.reference_range, beyond, network(scenario), lines)
    return replace(CarriedGovernor.of(scenario, program), tells_rows=True)  # rows of rho, or along G, are its own


def _certified(scenario: Scenario, *, at_once: bool = True) -> Governor:
    team, lines, settings = network(scenario), channel(scenario), scenario.governor
    model = TeamModel.of_scenario(scenario)
    repeats = 1 if lines is None else repeats_for(lines.loss.share, lines.loss.stay)
    longest = 0 if lines is None else int(lines.longest.max(initial=0))
    cycle_ticks = max(1, math.ceil(2 * team.diameter * (longest + repeats) / settings.rounds))
    limits = _advance_limits(scenario, model, cycle_ticks)
    if settings.optimizer == "flooding":
        if at_once and lines is None and cycle_ticks == 1:
            found = CERTIFICATES[settings.certificate](scenario, team)
            return CertifiedGovernor(limits, team.diameter, _compiled(scenario, found, limits))
        decision = _compiled(scenario, _verified(scenario, team), limits)
        if at_once and lines is None and decision is not None:
            return CycleGovernor(team, model, decision, settings.rounds, cycle_ticks)
        program = CertifiedProgram(team, _verified(scenario, team), model, limits, cycle_ticks, repeats)
        return CarriedGovernor(program, settings.rounds, lines)
    optimizer = OPTIMIZERS[settings.optimizer](scenario, team, _flow(scenario))
    of_team = EveryRobot(optimizer, team)
    if settings.optimizer == "paper_flow":
        of_team = CompiledPaperFlow(_paper_flow(scenario, None), BallCertificate.of(scenario, team))
    layer = LayerProgram(
        network=team,
        certificate=_verified(scenario, team),
        model=model,
        limits=limits,
        optimizer=Synchronizer(optimizer, lossy=lines is not None and lines.loss.share > 0.0),
        reference_range=settings.reference_range,
        cycle_ticks=cycle_ticks,
        repeats=repeats,
    )
    if at_once and lines is None and cycle_ticks == 1:
        return LayerGovernor(layer, of_team, settings.rounds, Schedule.of(team, settings.rounds))
    return CarriedGovernor(layer, settings.rounds, lines, tells_start=settings.initial == "start")


def _compiled(scenario: Scenario, found: Any, limits: tuple[AdvanceLimit, ...]) -> CompiledDecision | None:
    """Return the compiled decision by a certificate, None where `governor.backend` asks for NumPy."""
    if scenario.governor.backend == "numpy" or not isinstance(found, AdvanceCertificate):
        return None
    return CompiledDecision.of(found, limits)


def _verified(scenario: Scenario, team: Network) -> StateCertificate:
    """Return the certificate whose rows, once they hold, make the scenario's hold at every tick while m is held."""
    name = scenario.governor.certificate
    if name == "ball":
        return BallAtState.of(scenario, team, margin(scenario))
    found = CERTIFICATES[name](scenario, team)
    if isinstance(found, DirectionalBall):
        return replace(found, growth=found.growth**2)
    if not isinstance(found, StateCertificate):
        raise InputError(f"is {name}; allowed: a certificate of the state", key=CERTIFICATE_KEY)
    return found


def _advance_limits(scenario: Scenario, model: TeamModel, cycle_ticks: int) -> tuple[AdvanceLimit, ...]:
    """Return what stops advances of m. Raises InputError where beams are too short to move at all."""
    facets, robot, limits = speed_facets(scenario, scenario.governor.speed_rows), load_robot_model(scenario.robot), []
    grid = PredictionGrid.of(model)
    change = UNLIMITED
    if scenario.plant == "physics":
        change = wheel_facets(robot) * robot.time_constant / (cycle_ticks * model.tick)
    if len(facets) or len(change):
        limits.append(SpeedLimit.of(model, grid, facets, turning_offset(robot), change))
    estimator = scenario.estimator
    sees = estimator.source in ("beams", "points") and scenario.plant == "physics"
    if scenario.governor.sight_rows and sees and estimator.unknown == "free":  # else half-spaces end at what is seen
        limits.append(SightLimit.of(grid, np.array(scenario.beam_robots), _sight(scenario)))
    return tuple(limits)


def _rollout(scenario: Scenario, *, at_once: bool = True) -> Governor:
    lines, rounds = channel(scenario), scenario.governor.rounds
    plan = RolloutPlan.of(scenario, network(scenario), margin(scenario), lines)
    if at_once and lines is None:
        return RolloutGovernor(plan, rounds)
    return CarriedGovernor(RolloutProgram(plan), rounds, lines)


def _sight(scenario: Scenario) -> float:
    """Return how far robots may go before a wall comes into view [m]. Raises InputError where that is nowhere."""
    seen, beams = sight(scenario, load_robot_model(scenario.robot)), scenario.sensors.beams
    if seen > 0.0:
        return seen
    raise InputError(
        f"is true, but beams of {beams.range_max:g} m at {beams.rate_hz:g} Hz show walls too late for any advance; "
        "allowed: longer or faster beams, or false",
        key="governor.sight_rows",
    )


def speed_facets(scenario: Scenario, wheels: bool) -> np.ndarray:
    """Return the facets (F, 2) [s/m], in the body's axes, of the velocities that robots may be asked for."""
    control, robot = scenario.control, load_robot_model(scenario.robot)
    facets = [np.zeros((0, 2))]
    if scenario.plant == "physics" and wheels:
        facets.append(wheel_facets(robot))
        steerable = steerable_speed(robot, mean_delay(scenario))
        if steerable < robot.loaded_speed * robot.wheel_radius:
            facets.append(disc_facets(steerable, control.speed_facets))
    if control.speed_limit is not None:
        facets.append(disc_facets(control.speed_limit, control.speed_facets))
    return np.concatenate(facets)


GOVERNORS: dict[str, Callable[[Scenario], Governor]] = {
    "distributed": _distributed,
    "certified": _certified,
    "rollout": _rollout,
    "centralized": lambda scenario: CentralizedGovernor(ClarabelSolver()),
    "none": lambda scenario: NoGovernor(),
    "cbf": lambda scenario: NoGovernor(),  # `velocity_filters` does what is done
    "potential_field": lambda scenario: NoGovernor(),  # likewise
}


def governor(scenario: Scenario, given: Any = None) -> Governor:
    """Return the scenario's governor: one of ours, one of an installed package, or the object `given`.

    Raises InputError for an unknown name and wrong options, PlugInError when a plug-in cannot be built.
    """
    if given is None and scenario.governor.kind in GOVERNORS:
        return GOVERNORS[scenario.governor.kind](scenario)
    if not plugins.is_centralized(scenario.governor.kind, given):
        return robots_of_scenario(scenario, given)
    name, built = plugins.build(plugins.GOVERNOR, scenario, given, network=network(scenario))
    return PlugInGovernor(built, name, scenario.timing.plug_in_limit)


PROGRAMS: dict[str, Callable[[Scenario], Any]] = {
    "distributed": _paper_program,
    "certified": lambda scenario: _certified(scenario, at_once=False),
    "rollout": lambda scenario: _rollout(scenario, at_once=False),
}


def robot_programs(scenario: Scenario) -> CarriedGovernor:
    """Return the scenario's governor as a program of every robot, never computed for all of them at once.

    Raises InputError where it is none, PlugInError when a plug-in cannot be built.
    """
    kind = scenario.governor.kind
    if kind in PROGRAMS:
        return PROGRAMS[kind](scenario)
    if plugins.is_centralized(kind) or kind in GOVERNORS:
        allowed = f"allowed: {', '.join(PROGRAMS)}, or a robot program of an installed package"
        raise InputError(f"is {kind}, which robots do not run themselves; {allowed}", key="governor.kind")
    return robots_of_scenario(scenario).inner


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
        return CERTIFICATES[scenario.governor.certificate](scenario, graph)
    name, built = plugins.build(plugins.CERTIFICATE, scenario, given, network=graph)
    return PlugInCertificate(built, name, scenario.timing.plug_in_limit)


def reference_solver(scenario: Scenario, given: Any = None) -> CentralizedSolver | None:
    """Return the solver of the centralized reference, None where the scenario switched it off; likewise."""
    if given is None and scenario.reference.solver in SOLVERS:
        return SOLVERS[scenario.reference.solver]()
    if given is None and scenario.reference.solver == "none":
        return None
    name, built = plugins.build(plugins.REFERENCE_SOLVER, scenario, given, network=network(scenario))
    return PlugInSolver(built, name, scenario.timing.plug_in_limit)
