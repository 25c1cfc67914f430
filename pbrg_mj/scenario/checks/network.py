"""The graph is connected, and what happens to messages on its links is possible."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pbrg_mj.scenario.checks.robot_numbers import in_range
from pbrg_mj.scenario.diagnostics import Diagnostic, KeyPath, yaml_text
from pbrg_mj.scenario.schema import Scenario, edge_list, unreachable
from pbrg_mj.scenario.schema.network import Network, PreStabiliserNetwork

LONGEST_DELAY = 1000  # rounds: messages on their way are all kept


def graph(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield edges that are missing, wrong or twice there, and robots out of reach of the others."""
    section, n = scenario.graph, scenario.robots
    path = ("graph", "edges")
    if section.kind != "edges":
        if section.edges:
            yield Diagnostic(path, f"is given, but graph.kind is {section.kind}; allowed: only with `kind: edges`")
        return
    if n > 1 and not section.edges:
        yield Diagnostic(path, "is empty; required with `kind: edges`: pairs of robots such as [1, 2]")
        return
    wrong = list(_edges(path, section.edges, n))
    yield from wrong
    lonely = () if wrong else unreachable(edge_list(section, n), n)
    if lonely:
        yield Diagnostic(
            path, f"leave robot {lonely[0] + 1} out of reach of robot 1; allowed: a connected graph of {n} robots"
        )


def messages(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield what is wrong in the network section."""
    yield from _links(scenario)
    yield from _delays(scenario)
    yield from _jitter(scenario)
    yield from _bursts(scenario.network, ("network", "loss"))
    yield from _pre_stabiliser(scenario)


def _pre_stabiliser(scenario: Scenario) -> Iterator[Diagnostic]:
    network, path = scenario.network.pre_stabiliser, ("network", "pre_stabiliser")
    for key in ("delay_ticks", "jitter_ticks"):
        if getattr(network, key) > LONGEST_DELAY:
            yield Diagnostic((*path, key), f"is {getattr(network, key)} ticks; allowed: 0 to {LONGEST_DELAY}")
    yield from _bursts(network, (*path, "loss"))


def _links(scenario: Scenario) -> Iterator[Diagnostic]:
    edges, seen = set(edge_list(scenario.graph, scenario.robots)), set()
    for k, link in enumerate(scenario.network.links):
        path, pair = ("network", "links", k, "robots"), tuple(sorted(number - 1 for number in link.robots))
        if pair in seen:
            yield Diagnostic(path, f"is {yaml_text(link.robots)}, a link given twice; allowed: each link once")
        elif pair not in edges and max(link.robots) <= scenario.robots:
            yield Diagnostic(path, f"is {yaml_text(link.robots)}; allowed: two robots that are neighbours in the graph")
        seen.add(pair)


def _delays(scenario: Scenario) -> Iterator[Diagnostic]:
    network = scenario.network
    least = 1 if network.exchange == "scattering" else 0
    why = " with `exchange: scattering`" if least else ""
    message = f"allowed: {least} to {LONGEST_DELAY}{why}"
    everywhere = len(network.links) == len(edge_list(scenario.graph, scenario.robots)) > 0
    if not everywhere and not least <= network.delay_rounds <= LONGEST_DELAY:
        yield Diagnostic(("network", "delay_rounds"), f"is {network.delay_rounds} rounds; {message}")
    for k, link in enumerate(network.links):
        if not least <= link.delay_rounds <= LONGEST_DELAY:
            yield Diagnostic(("network", "links", k, "delay_rounds"), f"is {link.delay_rounds} rounds; {message}")


def _jitter(scenario: Scenario) -> Iterator[Diagnostic]:
    network = scenario.network
    most = max(0, LONGEST_DELAY - max((network.delay_rounds, *(link.delay_rounds for link in network.links))))
    if network.jitter_rounds > most:
        yield Diagnostic(
            ("network", "jitter_rounds"),
            f"is {network.jitter_rounds} rounds; allowed: 0 to {most}, {LONGEST_DELAY} with the longest delay",
        )
    if (network.reserve_rounds or 0) > LONGEST_DELAY:
        yield Diagnostic(
            ("network", "reserve_rounds"), f"is {network.reserve_rounds} rounds; allowed: 0 to {LONGEST_DELAY}"
        )


def _bursts(network: Network | PreStabiliserNetwork, path: KeyPath) -> Iterator[Diagnostic]:
    """A link that is lost for `burst` rounds at a time and good for at least one loses at most burst / (1 + burst)."""
    burst, loss = network.loss_burst, network.loss
    if burst is None:
        return
    most = burst / (1.0 + burst)
    if loss > most:
        unit = "rounds" if isinstance(network, Network) else "ticks"
        yield Diagnostic(path, f"is {loss}; allowed: at most {most:.4g} in runs of loss_burst, {burst:g} {unit}")


def _edges(path: KeyPath, edges: Sequence[tuple[int, int]], n: int) -> Iterator[Diagnostic]:
    seen: set[tuple[int, int]] = set()
    for k, (i, j) in enumerate(edges):
        edge = (min(i, j), max(i, j))
        yield from in_range((*path, k), edge[1], n)
        if i == j:
            yield Diagnostic(
                (*path, k), f"is {yaml_text((i, j))}, robot {i} with itself; allowed: two different robots"
            )
        elif edge in seen:
            yield Diagnostic((*path, k), f"is {yaml_text((i, j))}, an edge given twice; allowed: each pair once")
        seen.add(edge)
