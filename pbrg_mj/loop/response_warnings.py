"""Warnings before a run: a team that follows references faster than the paper's flow finds them."""

from __future__ import annotations

from pbrg_mj.governor.distributed.from_scenario import round_step
from pbrg_mj.governor.problem.ball import BallCertificate
from pbrg_mj.governor.stability.linear_step import max_gradient_norms
from pbrg_mj.governor.stability.response import response_ratio
from pbrg_mj.loop.stability_warnings import MOST_ROBOTS
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.graph import network
from pbrg_mj.text import counted

MAX_RATIO = 2.0  # of the ratio: the paper's runs are at 0.7 and 1.4


def response_warnings(scenario: Scenario) -> list[str]:
    """Return one line where a far reference is likely to take the team across a line on its way; docs/theory.md."""
    if scenario.governor.kind != "distributed" or scenario.robots > MOST_ROBOTS:
        return []
    ratio = scenario_ratio(scenario)
    if ratio <= MAX_RATIO:
        return []
    leaders = counted(len(scenario.team.leaders), "leader")
    line = (
        f"the team follows its references {ratio:.2g} times as fast as the flow of {leaders} finds them (paper: up to "
        "1.4): where r lies beyond a line, robots may cross it on the way to the optimum. A smaller control.alpha_r "
        "helps, or more governor.rounds of the same governor.step; governor.kind: certified keeps the line"
    )
    return [line]


def scenario_ratio(scenario: Scenario) -> float:
    """Return `response_ratio` of a scenario, at the rate at which its rounds run the flow."""
    settings, team = scenario.governor, network(scenario)
    ball = BallCertificate.of(scenario, team)
    gradients = max_gradient_norms(team, ball.formation, ball.inputs, ball.growth)
    flow_seconds = settings.rounds * round_step(scenario) / scenario.timing.tick  # in a second of the team's
    return response_ratio(team, scenario.control.alpha_r, settings.alpha, gradients) / flow_seconds
