"""Before a run: how long a round may be, and warnings of steps or delays that are unstable by linear theory."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pbrg_mj.governor.distributed.from_scenario import round_step
from pbrg_mj.governor.problem.ball import BallCertificate
from pbrg_mj.governor.stability.delay_margin import MAX_ROBOTS, DelayedRounds, delay_margin
from pbrg_mj.governor.stability.linear_step import linear_step_limit, max_gradient_norms
from pbrg_mj.governor.stability.proximal_step import proximal_step_bound
from pbrg_mj.scenario.checks.certificate import CERTIFIED
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.channel import channel
from pbrg_mj.team.exchange import exchange
from pbrg_mj.team.graph import network
from pbrg_mj.team.network import Network
from pbrg_mj.team.sampled import delay_margin as delay_margin_ticks
from pbrg_mj.text import counted

MOST_ROBOTS = 150  # whose modes are computed: a second or two, and it grows with the cube


def stability_warnings(scenario: Scenario) -> list[str]:
    """Return one line for everything that makes a run likely to fail; empty when no risk is known."""
    return [*_pre_stabiliser(scenario), *_governor(scenario)]


def step_bound(scenario: Scenario) -> str:
    """Return one line: how long a round of the distributed governor is and may be, and what that rests on."""
    if scenario.governor.kind != "distributed":
        return f"no rounds whose length is bounded (governor.kind: {scenario.governor.kind})"
    given = f"rounds of {round_step(scenario):.3g} s ({scenario.governor.integration}): "
    if scenario.robots > MOST_ROBOTS:
        return f"{given}what they may be is not computed for more than {MOST_ROBOTS} robots"
    if scenario.governor.integration == "proximal":
        bound = _proximal_bound(scenario, network(scenario))
        return f"{given}proved to converge below {bound:.2g} s, of a problem that is held and messages in their round"
    limit = linear_step_limit(network(scenario), scenario.governor.alpha, _gradients(scenario))
    return f"{given}linear modes alone are stable up to {limit:.2g} s; no bound is proved for explicit rounds"


def _pre_stabiliser(scenario: Scenario) -> Iterator[str]:
    """Yield what is known of a team that hears p and xi late: of the longest delay, on all links."""
    messages, team = exchange(scenario), network(scenario)
    longest = 0 if messages is None else int(messages.channel.longest.max(initial=0))
    if longest == 0:
        return
    tick, late = scenario.timing.tick, f"p and xi arrive up to {counted(longest, 'tick')} late"
    try:
        margin = delay_margin_ticks(team, scenario.control, tick, longest)
    except ValueError:
        yield f"{late}; whether the pre-stabiliser bears it is not computed for so many robots and ticks"
        return
    if margin is not None:
        at_all = f"up to {counted(margin, 'tick')}, {margin * tick:.2g} s" if margin >= 0 else "at no delay"
        yield f"{late}, at which the pre-stabiliser (eq. 2) is unstable on this graph; stable {at_all}"
    elif scenario.governor.kind in CERTIFIED:
        yield f"{late}; the certificate predicts a team that receives them at once, so it guarantees nothing here"


def _governor(scenario: Scenario) -> list[str]:
    if scenario.governor.kind != "distributed":
        return []
    if scenario.robots > MOST_ROBOTS:
        return [f"whether the governor's rounds are stable is not computed for more than {MOST_ROBOTS} robots"]
    team = network(scenario)
    if scenario.governor.integration == "proximal":
        return list(_proximal_step(scenario, team))
    gradients = _gradients(scenario)
    return list(_step(scenario, gradients)) or list(_delay(scenario, gradients))


def _gradients(scenario: Scenario) -> np.ndarray:
    ball = BallCertificate.of(scenario, network(scenario))
    return max_gradient_norms(network(scenario), ball.formation, ball.inputs, ball.growth)


def _step(scenario: Scenario, gradients: np.ndarray) -> Iterator[str]:
    alpha, step = scenario.governor.alpha, round_step(scenario)
    allowed = linear_step_limit(network(scenario), alpha, gradients)
    if step > allowed:
        yield (
            f"a round of {step:.3g} s may be too long for alpha = {alpha:g} on this graph: "
            f"its linear modes alone are stable up to {allowed:.2g} s. More rounds, or a smaller step, help"
        )


def _proximal_step(scenario: Scenario, team: Network) -> Iterator[str]:
    step, bound = round_step(scenario), _proximal_bound(scenario, team)
    if step >= bound:
        yield (
            f"a round of {step:.3g} s may be too long for alpha = {scenario.governor.alpha:g} on this graph: proximal "
            f"rounds are proved to converge up to {bound:.2g} s. More rounds, or a smaller step, help"
        )


def _proximal_bound(scenario: Scenario, team: Network) -> float:
    rows = scenario.estimator.half_spaces_per_robot * scenario.robots
    return proximal_step_bound(team, scenario.governor.alpha, rows)


def _delay(scenario: Scenario, gradients: np.ndarray) -> Iterator[str]:
    links, step = channel(scenario), round_step(scenario)
    if links is None or not links.longest.any() or scenario.network.exchange != "plain" or scenario.robots > MAX_ROBOTS:
        return  # waves bear any delay
    margin = delay_margin(DelayedRounds(network(scenario), scenario.governor.alpha, step, links.longest), gradients)
    if margin is not None:
        longest = int(links.longest.max())
        others = "" if np.all(links.longest == longest) else ", the others in proportion"
        yield (
            f"messages {counted(longest, 'round')} late, {longest * step:.3g} s, may be too late for alpha = "
            f"{scenario.governor.alpha:g} on this graph: the plain exchange's linear modes are stable up to {margin} "
            f"rounds, {margin * step:.2g} s{others}. `network.exchange: scattering` bears any delay"
        )
