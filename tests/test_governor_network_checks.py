"""What the network section of a scenario may say."""

from __future__ import annotations

import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.load import parse_scenario
from tests.scenario_texts import three

AT = "x.yaml:11: network."
PATH = {"graph": "{kind: path}"}
WRONG = {
    "link that is not there": (
        "{links: [{robots: [1, 3], delay_rounds: 2}]}",
        "links.0.robots: is [1, 3]; allowed: two robots that are neighbours in the graph",
    ),
    "link to itself": (
        "{links: [{robots: [2, 2], delay_rounds: 2}]}",
        "links.0.robots: is [2, 2]; allowed: two robots that are neighbours in the graph",
    ),
    "link to nobody": (
        "{links: [{robots: [1, 4], delay_rounds: 2}]}",
        "links.0.robots.1: is robot 4; allowed: 1 to 3, the number of robots in team.start",
    ),
    "link twice": (
        "{links: [{robots: [1, 2], delay_rounds: 2}, {robots: [2, 1], delay_rounds: 3}]}",
        "links.1.robots: is [2, 1], a link given twice; allowed: each link once",
    ),
    "waves at once": (
        "{exchange: scattering}",
        "delay_rounds: is 0 rounds; allowed: 1 to 1000 with `exchange: scattering`",
    ),
    "waves at once on a link": (
        "{exchange: scattering, delay_rounds: 3, links: [{robots: [1, 2], delay_rounds: 0}]}",
        "links.0.delay_rounds: is 0 rounds; allowed: 1 to 1000 with `exchange: scattering`",
    ),
    "delay without end": ("{delay_rounds: 1001}", "delay_rounds: is 1001 rounds; allowed: 0 to 1000"),
    "jitter without end": (
        "{delay_rounds: 600, jitter_rounds: 401}",
        "jitter_rounds: is 401 rounds; allowed: 0 to 400, 1000 with the longest delay",
    ),
    "a reserve without end": ("{reserve_rounds: 1001}", "reserve_rounds: is 1001 rounds; allowed: 0 to 1000"),
    "more loss than such bursts make": (
        "{loss: 0.8, loss_burst: 3}",
        "loss: is 0.8; allowed: at most 0.75 in runs of loss_burst, 3 rounds",
    ),
    "silence of nobody": (
        "{outages: [{robot: 7, time: 1}]}",
        "outages.0.robot: is robot 7; allowed: 1 to 3, the number of robots in team.start",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_cannot_be_is_told(case):
    section, message = WRONG[case]
    with pytest.raises(InputError) as caught:
        parse_scenario(three(**PATH, network=section), "x.yaml")
    assert str(caught.value) == AT + message


@pytest.mark.parametrize(
    "section",
    [
        "{exchange: scattering, delay_rounds: 1}",
        "{exchange: scattering, links: [{robots: [1, 2], delay_rounds: 1}, {robots: [3, 2], delay_rounds: 9}]}",
        "{delay_rounds: 1000, loss: 0.75, loss_burst: 3}",
        "{loss: 1}",
        "{delay_rounds: 600, jitter_rounds: 400, reordering: false, reserve_rounds: 1000}",
    ],
)
def test_what_can_be_passes(section):
    parse_scenario(three(**PATH, network=section))
