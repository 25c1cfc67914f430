"""`graph`: which robots exchange messages."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

from pydantic import Field

from pbrg_mj.scenario.schema.base import RobotNumber, Section

Edge = tuple[int, int]


class Graph(Section):
    """Which robots exchange messages: fixed, undirected, connected."""

    kind: Literal["ring", "path", "complete", "edges"] = Field(default="ring", description="shape of the network")
    edges: tuple[tuple[RobotNumber, RobotNumber], ...] = Field(
        default=(), description="pairs of robots, for `kind: edges`"
    )


def edge_list(graph: Graph, n: int) -> tuple[Edge, ...]:
    """Return the undirected edges (i, j), i < j, counted from 0, sorted, each once, for n robots.

    Expects a graph that passed the scenario's checks: `edges` within 1..n.
    """
    return tuple(sorted({(min(pair), max(pair)) for pair in _pairs(graph, n)}))


def unreachable(edges: Iterable[Edge], n: int) -> tuple[int, ...]:
    """Return the robots, counted from 0 and ascending, to which no path leads from robot 0."""
    neighbours: list[list[int]] = [[] for _ in range(n)]
    for i, j in edges:
        neighbours[i].append(j)
        neighbours[j].append(i)
    seen = {0}
    frontier = [0]
    while frontier:
        new = [k for k in neighbours[frontier.pop()] if k not in seen]
        seen.update(new)
        frontier.extend(new)
    return tuple(i for i in range(n) if i not in seen)


def _pairs(graph: Graph, n: int) -> Iterable[Edge]:
    path = [(i, i + 1) for i in range(n - 1)]
    match graph.kind:
        case "path":
            return path
        case "ring":
            return [*path, (n - 1, 0)] if n > 1 else path
        case "complete":
            return [(i, j) for i in range(n) for j in range(i + 1, n)]
        case "edges":
            return [(i - 1, j - 1) for i, j in graph.edges]
