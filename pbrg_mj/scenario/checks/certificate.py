"""Which governors and certificates go together."""

from __future__ import annotations

from collections.abc import Iterator

from pbrg_mj.scenario.diagnostics import Diagnostic
from pbrg_mj.scenario.schema import Governor, Scenario

STATE_DEPENDENT = ("directional_ball", "predictive")
"""Certificates whose rows are made of the states of the whole team, tick by tick."""
CERTIFIED = ("certified", "rollout")
"""Governors that apply what a certificate has verified."""


def certificate(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield what is wrong between governor, certificate and messages."""
    governor = scenario.governor
    yield from _program(scenario)
    yield from _proximal(scenario)
    yield from _motors(scenario)
    if governor.kind in CERTIFIED:
        yield from _certified(scenario)
    elif governor.kind == "cbf":
        yield from _barrier(scenario)
    elif governor.kind == "distributed" and governor.certificate == "predictive":
        yield Diagnostic(
            ("governor", "certificate"),
            "is predictive with `kind: distributed`, whose estimates lag the team by more than this certificate "
            "leaves; allowed: ball, directional_ball, or `kind: certified` or centralized",
        )


def _program(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield what robots that run the paper's algorithm one by one do not do."""
    governor, path = scenario.governor, ("governor", "backend")
    if governor.backend != "program":
        return
    if governor.kind != "distributed":
        yield Diagnostic(path, f"is program with `kind: {governor.kind}`; allowed: with `kind: distributed` only")
    if scenario.network.exchange != "plain":
        yield Diagnostic(path, "is program; allowed: with `network.exchange: plain` only")


def _proximal(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield what proximal rounds do not do: their convergence is proved of rho, and of messages without delay."""
    governor, network = scenario.governor, scenario.network
    if governor.integration != "proximal" or governor.kind != "distributed":
        return
    path = ("governor", "integration")
    if governor.certificate != "ball":
        yield Diagnostic(path, f"is proximal with `certificate: {governor.certificate}`; allowed: with ball only")
    late = network.delay_rounds or network.jitter_rounds or any(link.delay_rounds for link in network.links)
    if network.exchange != "plain" or late or network.loss or network.outages:
        yield Diagnostic(
            path,
            "is proximal with waves, or with messages that are late or lost; allowed: with `network.exchange: plain` "
            "without delay, jitter, loss and outages",
        )


def _motors(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield where nothing is predicted behind motors, or there are none."""
    governor, path = scenario.governor, ("governor", "predicted_motion")
    if governor.predicted_motion == "kinematic":
        return
    if scenario.plant != "physics":
        yield Diagnostic(path, f"is motors with `plant: {scenario.plant}`; allowed: kinematic, or `plant: physics`")
    if scenario.drive.kind != "voltage":
        yield Diagnostic(
            path,
            f"is motors with `drive.kind: {scenario.drive.kind}`, which follows within a tick or two; allowed: "
            "kinematic, or `drive.kind: voltage`",
        )
    flooding = governor.kind == "certified" and governor.optimizer == "flooding"
    if governor.certificate != "predictive" or not (flooding or governor.kind == "centralized"):
        optimizer = f", `optimizer: {governor.optimizer}`" if governor.kind == "certified" else ""
        yield Diagnostic(
            path,
            f"is motors with `kind: {governor.kind}`{optimizer} and `certificate: {governor.certificate}`; allowed: "
            "kinematic, or `certificate: predictive` with `kind: certified` and `optimizer: flooding`, or with `kind: "
            "centralized`",
        )


def guard(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield that the guard of earlier versions is gone; their logs still open."""
    if scenario.governor.guard:
        yield Diagnostic(
            ("governor", "guard"),
            "is true, and the guard is no more; allowed: false, and in its place `kind: certified` with "
            "`optimizer: paper_flow` and `certificate: ball`",
        )


def _barrier(scenario: Scenario) -> Iterator[Diagnostic]:
    gain, most = scenario.governor.barrier_gain, 1.0 / scenario.timing.tick
    if gain > most * (1 + 1e-9):
        yield Diagnostic(
            ("governor", "barrier_gain"),
            f"is {gain:g} 1/s, at which a hand point is beyond a half-space within a tick; "
            f"allowed: at most 1 / timing.tick, {most:g} 1/s",
        )


def _allowed(governor: Governor) -> tuple[str, ...]:
    if governor.kind == "rollout":
        return ("predictive",)
    return STATE_DEPENDENT if governor.optimizer == "flooding" else (*STATE_DEPENDENT, "ball")


def _certified(scenario: Scenario) -> Iterator[Diagnostic]:
    governor, network = scenario.governor, scenario.network
    allowed = _allowed(governor)
    if governor.certificate not in allowed:
        other = "; ball with another `governor.optimizer` than flooding" if governor.kind == "certified" else ""
        yield Diagnostic(
            ("governor", "certificate"),
            f"is {governor.certificate} with `kind: {governor.kind}`; allowed: {', '.join(allowed)}{other}",
        )
    if len(scenario.team.leaders) > 1 and (network.loss > 0 or network.outages):
        yield Diagnostic(
            ("team", "leaders"),
            "are several while messages are lost or robots silent, so that leaders could move apart; allowed with "
            f"`kind: {governor.kind}`: one",
        )
