"""Messages of the governor: links that exist, waves that take their time, and losses that can come in such bursts."""

from __future__ import annotations

from collections.abc import Iterator

from pbrg_mj.scenario.findings import Finding
from pbrg_mj.scenario.graph import edge_list
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.scenario.words import show

LONGEST_DELAY = 1000  # rounds: messages on their way are all kept


def messages(scenario: Scenario) -> Iterator[Finding]:
    """Yield what is wrong in the network section."""
    yield from _links(scenario)
    yield from _delays(scenario)
    yield from _bursts(scenario)
    yield from _guarded(scenario)


def _guarded(scenario: Scenario) -> Iterator[Finding]:
    network = scenario.network
    late = network.delay_rounds > 0 or any(link.delay_rounds > 0 for link in network.links)
    if scenario.governor.guard and (late or network.loss > 0 or network.silences or network.exchange != "plain"):
        yield Finding(
            ("governor", "guard"),
            "is true with messages that are late, lost or silent, which its own messages would not be; "
            "allowed: with an immediate plain exchange only",
        )


def _links(scenario: Scenario) -> Iterator[Finding]:
    edges, seen = set(edge_list(scenario.graph, scenario.robots)), set()
    for k, link in enumerate(scenario.network.links):
        path, pair = ("network", "links", k, "robots"), tuple(sorted(number - 1 for number in link.robots))
        if pair in seen:
            yield Finding(path, f"is {show(link.robots)}, a link given twice; allowed: each link once")
        elif pair not in edges and max(link.robots) <= scenario.robots:
            yield Finding(path, f"is {show(link.robots)}; allowed: two robots that are neighbours in the graph")
        seen.add(pair)


def _delays(scenario: Scenario) -> Iterator[Finding]:
    network = scenario.network
    least = 1 if network.exchange == "scattering" else 0
    why = " with `exchange: scattering`" if least else ""
    told = f"allowed: {least} to {LONGEST_DELAY}{why}"
    everywhere = len(network.links) == len(edge_list(scenario.graph, scenario.robots)) > 0
    if not everywhere and not least <= network.delay_rounds <= LONGEST_DELAY:
        yield Finding(("network", "delay_rounds"), f"is {network.delay_rounds} rounds; {told}")
    for k, link in enumerate(network.links):
        if not least <= link.delay_rounds <= LONGEST_DELAY:
            yield Finding(("network", "links", k, "delay_rounds"), f"is {link.delay_rounds} rounds; {told}")


def _bursts(scenario: Scenario) -> Iterator[Finding]:
    """A link that is lost for `burst` rounds at a time and good for at least one loses at most burst / (1 + burst)."""
    burst, loss = scenario.network.loss_burst, scenario.network.loss
    if burst is None:
        return
    most = burst / (1.0 + burst)
    if loss > most:
        yield Finding(
            ("network", "loss"), f"is {loss}; allowed: at most {most:.4g} in runs of loss_burst, {burst:g} rounds"
        )
