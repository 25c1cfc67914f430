"""What stands in a building: shapes in the frame of the way, and their footprints."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise, product

import numpy as np
from other_worlds.geometry import turned
from other_worlds.solids import Solids

LETTERS = {  # outlines on a grid
    "T": [(0, 0), (3, 0), (3, 1), (2, 1), (2, 3), (1, 3), (1, 1), (0, 1)],
    "U": [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)],
    "S": [(0, 0), (2, 0), (2, 1), (3, 1), (3, 2), (1, 2), (1, 1), (0, 1)],
    "E": [(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (2, 2), (2, 3), (1, 3), (1, 4), (3, 4), (3, 5), (0, 5)],
    "plus": [(1, 0), (2, 0), (2, 1), (3, 1), (3, 2), (2, 2), (2, 3), (1, 3), (1, 2), (0, 2), (0, 1), (1, 1)],
}


def maze(solids: Solids) -> None:
    """Add the walls of three to five rows of cells, 0.9 to 1.7 m wide, each of which is open to some other."""
    rng, size = solids.rng, int(solids.rng.integers(3, 6))
    cell, thickness, doors = solids.uniform(0.9, 1.7), float(rng.choice([0.02, 0.05, 0.1])), solids.uniform(0.0, 0.5)
    corner, turn = -cell * (size / 2 + rng.uniform(-0.5, 0.5, 2)), solids.uniform(0.0, np.pi / 2)
    opened = _spanning_tree(rng, size)
    for i, j in product(range(size), repeat=2):
        for along, beyond in (((0, 1), (i + 1, j)), ((1, 0), (i, j + 1))):
            if max(beyond) < size and (frozenset([(i, j), beyond]) in opened or rng.random() < doors):
                continue
            ends = np.array([np.array([i + 1, j + 1]) - along, [i + 1, j + 1]])
            start, end = solids.scale * turned(corner + cell * ends, turn)
            solids.wall(start, end, thickness)


def _spanning_tree(rng: np.random.Generator, size: int) -> set[frozenset[tuple[int, int]]]:
    """Return pairs of neighbours on a grid that join all of its cells (depth-first)."""
    way, seen, pairs = [(0, 0)], {(0, 0)}, set()
    while way:
        i, j = way[-1]
        beside = [one for one in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)) if one not in seen]
        beside = [one for one in beside if min(one) >= 0 and max(one) < size]
        if beside:
            way.append(beside[int(rng.integers(len(beside)))])
            seen.add(way[-1])
            pairs.add(frozenset([(i, j), way[-1]]))
        else:
            way.pop()
    return pairs


def tables(solids: Solids) -> None:
    """Add the four legs each of one to five tables; legs are round or square, 4 to 8 cm thick."""
    for _ in range(int(solids.rng.integers(1, 6))):
        place, turn = solids.scale * solids.rng.uniform(-2.5, 2.5, 2), solids.uniform(0, np.pi)
        sides, radius = solids.rng.uniform(0.35, 1.0, 2), float(solids.rng.choice([0.02, 0.025, 0.03, 0.04]))
        for corner in turned(solids.scale * 0.5 * sides * np.array(list(product((-1, 1), repeat=2))), turn):
            if solids.rng.random() < 0.5:
                solids.column(place + corner, radius)
            else:
                solids.box(place + corner, np.full(2, 2 * radius), turn - solids.direction)


def letters(solids: Solids) -> None:
    """Add one to three prisms that are not convex, of up to 2.8 m."""
    for _ in range(int(solids.rng.integers(1, 4))):
        outline = np.array(LETTERS[str(solids.rng.choice(list(LETTERS)))]) - 1.5
        outline = outline * solids.uniform(0.12, 0.4) * solids.rng.uniform(0.6, 1.4, 2)
        place = solids.scale * solids.rng.uniform(-2.3, 2.3, 2)
        solids.prism(place + solids.scale * turned(outline, solids.uniform(0.0, 2 * np.pi)))


def curved_wall(solids: Solids) -> None:
    """Add a wall along an arc of 45 to 315 degrees around the team or beside it."""
    centre, radius = solids.rng.uniform(-1.0, 1.0, 2), solids.uniform(0.7, 3.0)
    span, thickness = solids.uniform(0.8, 5.5), float(solids.rng.choice([0.03, 0.06, 0.15]))
    parts = min(int(span * radius / 0.12) + 2, 60)
    angles = solids.uniform(0.0, 2 * np.pi) + np.linspace(0.0, span, parts + 1)
    inner = np.column_stack([np.cos(angles), np.sin(angles)])
    for one, other in pairwise(inner):
        corners = np.array([radius * one, radius * other, (radius + thickness) * other, (radius + thickness) * one])
        solids.prism(solids.scale * (centre + corners))


def slalom(solids: Solids) -> None:
    """Add four to nine columns of 2.5 to 20 cm radius to either side of a line."""
    turn, gap = solids.uniform(0.0, 2 * np.pi), solids.uniform(0.35, 1.1)
    for k in range(int(solids.rng.integers(4, 10))):
        place = turned(np.array([[0.5 + 0.7 * gap * k, 0.5 * gap * (-1) ** k]]), turn)[0]
        solids.column(solids.scale * place, 10 ** solids.uniform(-1.6, -0.7))


def bend(solids: Solids) -> None:
    """Add a corridor 0.9 to 2 m wide around the team, every other one with a bend."""
    turn, half, length = solids.uniform(0.0, 2 * np.pi), solids.uniform(0.45, 1.0), solids.uniform(1.0, 4.0)
    thickness, straight = float(solids.rng.choice([0.03, 0.08])), solids.rng.random() < 0.5
    near, far = length / 2, length / 2 + 2 * half
    for side, end in ((-half, near), (half, far)):
        corners = [[-length, side], [end, side], [end, -half - length]]
        corners = [[-length, side], [length, side]] if straight else corners
        for one, other in pairwise(solids.scale * turned(np.array(corners), turn)):
            solids.wall(one, other, thickness)


def crates(solids: Solids) -> None:
    """Add three to eleven boxes of 5 to 70 cm anywhere."""
    for _ in range(int(solids.rng.integers(3, 12))):
        place, size = solids.scale * solids.rng.uniform(-2.8, 2.8, 2), solids.rng.uniform(0.05, 0.7, 2)
        solids.box(place, size, solids.uniform(0.0, np.pi))


def panels(solids: Solids) -> None:
    """Add two to six panels, 1 to 3 cm thick, anywhere."""
    for _ in range(int(solids.rng.integers(2, 7))):
        middle, turn = solids.rng.uniform(-2.5, 2.5, 2), solids.uniform(0.0, np.pi)
        ends = middle + solids.uniform(0.1, 0.6) * np.array([[-1], [1]]) * [np.cos(turn), np.sin(turn)]
        solids.wall(*(solids.scale * ends), float(solids.rng.choice([0.01, 0.02, 0.03])))


INDOOR: dict[str, Callable[[Solids], None]] = {
    one.__name__: one for one in (maze, tables, letters, curved_wall, slalom, bend, crates, panels)
}
