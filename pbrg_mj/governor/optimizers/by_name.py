"""Optimizers by the names a scenario calls them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pbrg_mj.governor.distributed.estimates import Flow
from pbrg_mj.governor.optimizers.admm import Admm
from pbrg_mj.governor.optimizers.flow_in_m import FlowInM
from pbrg_mj.governor.optimizers.interface import Optimizer
from pbrg_mj.governor.optimizers.nids import Nids
from pbrg_mj.governor.optimizers.paper_flow import PaperFlow
from pbrg_mj.governor.optimizers.scalar import Scalar
from pbrg_mj.governor.problem.ball import BallCertificate
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.network import Network


def _nids(scenario: Scenario, team: Network, flow: Flow) -> Optimizer:
    settings = scenario.governor.nids
    stiffest = float(np.linalg.eigvalsh(team.laplacian)[-1])  # lambda_max(L); 0 of one robot alone
    return Nids(settings.step, settings.mixing / stiffest if team.robots > 1 else 0.0)


def _flow_in_m(scenario: Scenario, team: Network, flow: Flow) -> Optimizer:
    settings = scenario.governor.flow_in_m
    return FlowInM(settings.step, settings.gain, settings.augmentation)


def _paper_flow(scenario: Scenario, team: Network, flow: Flow) -> Optimizer:
    return PaperFlow(flow, BallCertificate.of(scenario, team), team.robots)


OPTIMIZERS: dict[str, Callable[[Scenario, Network, Flow], Optimizer]] = {
    "nids": _nids,
    "admm": lambda scenario, team, flow: Admm(scenario.governor.admm.penalty),
    "flow_in_m": _flow_in_m,
    "scalar": lambda scenario, team, flow: Scalar(),
    "paper_flow": _paper_flow,
}
