"""The certified governor of a scenario: computed at once where messages are in time, as robots' programs elsewhere."""

from __future__ import annotations

import math
from typing import Any

from pbrg_mj.governor.certificate.advances import AdvanceCertificate
from pbrg_mj.governor.certificate.by_name import CERTIFICATES, verified
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.certified.advance_limits import advance_limits
from pbrg_mj.governor.certified.compiled import CompiledDecision
from pbrg_mj.governor.certified.cycles import CycleGovernor
from pbrg_mj.governor.certified.decide import AdvanceLimit
from pbrg_mj.governor.certified.governor import CertifiedGovernor
from pbrg_mj.governor.certified.layer import LayerProgram
from pbrg_mj.governor.certified.robot import CertifiedProgram, repeats_for, state_struct
from pbrg_mj.governor.certified.vectorized import LayerGovernor, Schedule
from pbrg_mj.governor.distributed.from_scenario import flow, paper_flow
from pbrg_mj.governor.messaging.networked import NetworkedGovernor
from pbrg_mj.governor.optimizers.by_name import OPTIMIZERS
from pbrg_mj.governor.optimizers.synchronizer import Synchronizer
from pbrg_mj.governor.optimizers.team import CompiledPaperFlow, StepByRobot
from pbrg_mj.governor.problem.ball import BallCertificate
from pbrg_mj.governor.problem.interface import Governor
from pbrg_mj.governor.problem.near_reference import farthest_reference
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.channel import channel
from pbrg_mj.team.graph import network


def certified(scenario: Scenario, *, vectorized: bool = True) -> Governor:
    """Return the governor; not `vectorized`: as programs of every robot. Raises InputError."""
    team, lines, settings = network(scenario), channel(scenario), scenario.governor
    model = TeamModel.of_scenario(scenario)
    repeats = 1 if lines is None else repeats_for(lines.loss.share, lines.loss.stay)
    longest = 0 if lines is None else int(lines.longest.max(initial=0))
    cycle_ticks = max(1, math.ceil(2 * team.diameter * (longest + repeats) / settings.rounds))
    limits, farthest = advance_limits(scenario, model, cycle_ticks), farthest_reference(scenario.plant)
    if settings.optimizer == "flooding":
        if vectorized and lines is None and cycle_ticks == 1:
            found = CERTIFICATES[settings.certificate](scenario, team)
            compiled = _compiled(scenario, found, limits)
            reach, state_bytes = settings.reference_range, state_struct(model).size
            return CertifiedGovernor(limits, team.diameter, reach, compiled, farthest, state_bytes)
        decision = _compiled(scenario, verified(scenario, team), limits)
        if vectorized and lines is None and decision is not None:
            return CycleGovernor(team, model, decision, settings.rounds, cycle_ticks)
        program = CertifiedProgram(
            network=team,
            certificate=verified(scenario, team),
            model=model,
            limits=limits,
            reach=settings.reference_range,
            cycle_ticks=cycle_ticks,
            repeats=repeats,
            farthest=farthest,
        )
        return NetworkedGovernor(program, settings.rounds, lines)
    optimizer = OPTIMIZERS[settings.optimizer](scenario, team, flow(scenario))
    of_team = StepByRobot(optimizer, team)
    if settings.optimizer == "paper_flow":
        of_team = CompiledPaperFlow(paper_flow(scenario, None), BallCertificate.of(scenario, team))
    layer = LayerProgram(
        network=team,
        certificate=verified(scenario, team),
        model=model,
        limits=limits,
        optimizer=Synchronizer(optimizer, lossy=lines is not None and lines.loss.share > 0.0),
        reference_range=settings.reference_range,
        cycle_ticks=cycle_ticks,
        repeats=repeats,
        diverged_beyond=scenario.divergence_limit,
    )
    if vectorized and lines is None and cycle_ticks == 1:
        return LayerGovernor(layer, of_team, settings.rounds, Schedule.of(team, settings.rounds))
    return NetworkedGovernor(layer, settings.rounds, lines, shares_start=settings.initial == "start")


def _compiled(scenario: Scenario, found: Any, limits: tuple[AdvanceLimit, ...]) -> CompiledDecision | None:
    """Return the compiled decision by a certificate, None where `governor.backend` asks for NumPy."""
    if scenario.governor.backend == "numpy" or not isinstance(found, AdvanceCertificate):
        return None
    reach, farthest = scenario.governor.reference_range, farthest_reference(scenario.plant)
    return CompiledDecision.of(found, limits, reach, farthest)
