"""Certificates by the names a scenario calls them, and what they keep from half-spaces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from pbrg_mj.errors import InputError
from pbrg_mj.governor.certificate.ball import BallAtState
from pbrg_mj.governor.certificate.directional_ball import DirectionalBall
from pbrg_mj.governor.certificate.predictive import PredictiveCertificate
from pbrg_mj.governor.problem.ball import BallCertificate
from pbrg_mj.governor.problem.directional_ball import DirectionalBallCertificate
from pbrg_mj.governor.problem.interface import Certificate, StateCertificate
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.network import Network

CERTIFICATES: dict[str, Callable[[Scenario, Network], Certificate | StateCertificate]] = {
    "ball": BallCertificate.of,
    "directional_ball": lambda scenario, team: _directional_ball(scenario, team),
    "predictive": lambda scenario, team: PredictiveCertificate.of(scenario, margin(scenario)),
}
CERTIFICATE_KEY = "governor.certificate"
DEFAULT_MARGIN = 0.01  # [m] in physics, for what the linear model leaves out: docs/certified.md


def margin(scenario: Scenario) -> float:
    """Return what certificates keep from half-spaces [m]: as given, or what suits the plant."""
    given = scenario.governor.margin
    if given is not None:
        return given
    return DEFAULT_MARGIN if scenario.plant == "physics" else 0.0


def verified(scenario: Scenario, team: Network) -> StateCertificate:
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


def _directional_ball(scenario: Scenario, team: Network) -> Certificate | StateCertificate:
    """Return rows of the norm for the paper's flow, whose robots estimate the state; for all else the intervals."""
    if scenario.governor.kind == "distributed":
        return DirectionalBallCertificate.of(scenario, team, margin(scenario))
    return DirectionalBall.of(scenario, margin(scenario))
