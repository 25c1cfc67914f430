"""Ten thousand robots of the ideal plant under the rollout governor, on a random 6-regular graph with 20 % leaders.

`pbrg run` keeps matrices of n x n numbers (the Laplacian, which half-space binds whom, the certificate in the log), and
so takes 500 robots at most. This runs the governor's own code, `governor/rollout/team.py`, and eq. 2 on sparse arrays.

A wall seen by one robot, no leader, binds every robot; the reference lies a metre beyond it.

    python scripts/rollout_scale.py [--robots 10000] [--seed 1]
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array, eye_array, hstack, vstack
from scipy.sparse.linalg import LinearOperator, svds

from pbrg_mj.governor.rollout.messages import HalfSpace
from pbrg_mj.governor.rollout.plan import RolloutPlan, step_weights
from pbrg_mj.governor.rollout.team import run_cycle
from pbrg_mj.governor.rollout.verdicts import advance
from pbrg_mj.team.pre_stabiliser import write_pre_stabilised

TICK, ALPHA_R, LEAK = 0.05, 2.5, 0.0
ORDER = 8  # rounds of a step, of as many ticks: exact
TAIL = 0.01  # bound of what comes after the rollout, per metre of error
SPACING = 0.35  # [m] of the formation, a square
TOLERANCE = 0.05  # [m] of a settled team


def regular_edges(n: int, rng: np.random.Generator) -> np.ndarray:
    """Return the edges (3 n, 2) of a random 6-regular graph: a circulant one, its edges swapped at random."""
    edges = [(i, (i + k) % n) for k in (1, 2, 3) for i in range(n)]
    there = {frozenset(edge) for edge in edges}
    for one, other in rng.integers(0, len(edges), size=(10 * len(edges), 2)).tolist():
        (a, b), (c, d) = edges[one], edges[other]
        fresh = frozenset((a, d)), frozenset((c, b))
        if len({a, b, c, d}) == 4 and not there.intersection(fresh):
            there.difference_update((frozenset((a, b)), frozenset((c, d))))
            there.update(fresh)
            edges[one], edges[other] = (a, d), (c, b)
    return np.array(edges)


def graph_of(
    n: int, edges: np.ndarray, leader: np.ndarray
) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], csr_array]:
    """Return first, neighbours, leader of `GraphArrays`, and the Laplacian."""
    both = np.concatenate([edges, edges[:, ::-1]])
    adjacency = coo_array((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(n, n)).tocsr()
    adjacency.sort_indices()
    laplacian = diags_array(adjacency.sum(axis=1)) - adjacency
    first, neighbours = adjacency.indptr.astype(np.int64), adjacency.indices.astype(np.int64)
    return (first, neighbours, leader), laplacian.tocsr()


def hops(graph: tuple[np.ndarray, ...], start: int) -> int:
    """Return how many links the farthest robot is from one."""
    first, neighbours, _ = graph
    reached = np.arange(len(first) - 1) == start
    count = 0
    while not reached.all():
        reached |= np.logical_or.reduceat(reached[neighbours], first[:-1])
        count += 1
    return count


def norm_of_power(step: csr_array, ticks: int) -> float:
    """Return ||A^ticks||_2 on what moves, by Lanczos' method."""
    n = step.shape[0] // 2
    back = step.T.tocsr()

    def powered(matrix: csr_array, x: np.ndarray) -> np.ndarray:
        x = x.reshape(-1).copy()
        x[n:] -= x[n:].mean()
        for _ in range(ticks):
            x = matrix @ x
        x[n:] -= x[n:].mean()
        return x

    operator = LinearOperator(step.shape, lambda x: powered(step, x), lambda x: powered(back, x), dtype=float)
    start = np.random.default_rng(0).normal(size=2 * n)
    return float(svds(operator, k=1, v0=start, tol=1e-2, return_singular_vectors=False)[0])


def growth(step: csr_array) -> float:
    """Return sup_t ||A^t||_2: the largest until one is at most 1, as `TeamModel.growth`."""
    largest, ticks = 1.0, 1
    while (norm := norm_of_power(step, ticks)) > 1.0 + 1e-9:
        largest, ticks = max(largest, norm), ticks + 1
    return largest


def plan_of(graph: tuple[np.ndarray, ...], laplacian: csr_array, formation: np.ndarray, diameter: int) -> RolloutPlan:
    """Return the plan: exact steps, and so long that what comes after is bounded by TAIL.

    ||e_j' A^t||_1 <= sqrt(2 n) ||A^t||_2 for every robot and every t after the last tick.
    """
    n, leads = len(formation), diags_array(graph[2])
    rate = vstack([hstack([-laplacian - ALPHA_R * leads, laplacian]), hstack([-laplacian, -LEAK * laplacian])])
    step = (eye_array(2 * n) + TICK * rate).tocsr()
    largest, steps = growth(step), 25
    while (tail := np.sqrt(2 * n) * largest * norm_of_power(step, steps * ORDER)) > TAIL:
        steps += 5
    bound = np.full(n, tail)
    return RolloutPlan(
        gains=(ALPHA_R, LEAK, TICK),
        formation=formation,
        margin=0.0,
        weights=step_weights(ORDER, ORDER),
        steps=steps,
        error=np.zeros((steps * ORDER + 1, n)),
        from_start=bound,
        from_hold=bound,
        diameter=diameter,
        cycle_ticks=1,
    )


def main() -> None:
    """Run it, and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--duration", type=float, default=12.0, help="[s]")
    given = parser.parse_args()
    n, rng, began = given.robots, np.random.default_rng(given.seed), time.perf_counter()
    leader = (rng.permutation(n) < n // 5).astype(float)
    graph, laplacian = graph_of(n, regular_edges(n, rng), leader)
    owner = int(np.flatnonzero(leader == 0.0)[0])
    diameter = 2 * hops(graph, owner)  # or less
    side = int(np.ceil(np.sqrt(n)))
    formation = SPACING * np.column_stack(np.divmod(np.arange(n), side)).astype(float)
    plan = plan_of(graph, laplacian, formation, diameter)
    print(
        f"{n} robots, {int(leader.sum())} leaders, diameter at most {diameter}, tail {plan.from_start[0]:.1e}",
        flush=True,
    )
    print(f"{plan.exchanges} rounds a tick of {TICK} s look {plan.steps * ORDER * TICK:.0f} s ahead", flush=True)
    print(f"set up in {time.perf_counter() - began:.0f} s", flush=True)
    simulate(plan, graph, owner, rng, round(given.duration / TICK))
    print(f"{time.perf_counter() - began:.0f} s in all")


def simulate(plan: RolloutPlan, graph: tuple, owner: int, rng: np.random.Generator, ticks: int) -> None:
    """Run the closed loop of the ideal plant from random places at rest, and print what came of it."""
    n, formation, leads = len(plan.formation), plan.formation, graph[2] > 0.0
    G, r = np.array([0.6, 0.8]), np.array([2.0, 2.5])
    h = float((formation @ G).max() + G @ r - 1.0)  # so that the best m is 1 m short of r
    half_spaces, best = {(owner, 0): HalfSpace(True, float(G[0]), float(G[1]), h)}, r - G
    p, xi, held, response = 0.3 * rng.normal(size=(n, 2)), np.zeros((n, 2)), np.full(2, np.nan), None
    start, worst, late, bytes_sent = p.copy(), -np.inf, 0, []
    u, rate = np.empty((n, 2)), np.empty((n, 2))
    for tick in range(ticks):
        cycle = run_cycle(plan, graph, (p, xi), held, half_spaces, response)
        response, degree = cycle.response, np.diff(graph[0])
        bytes_sent.append((cycle.bytes_sent / degree).max(axis=1))
        centre = cycle.summary.centre
        if cycle.verdicts is None:
            held = centre
        else:
            held = held + advance(r - held, cycle.verdicts, centre - held, plan.reach)[0]
        m = np.where(leads[:, None], held, start)
        write_pre_stabilised(graph, (p, xi, m), ALPHA_R, LEAK, u, rate)
        p, xi = p + TICK * u, xi + TICK * rate
        worst = max(worst, float(((p + formation) @ G).max() - h))
        if np.linalg.norm(p - best, axis=1).max() > TOLERANCE:
            late = tick + 1
    gap = np.linalg.norm(p - best, axis=1).max()
    print(f"settled within {TOLERANCE} m of the best point in {TICK * (late + 1):.2f} s, {gap:.1e} m off at the end")
    print(f"worst crossing of the wall {worst:.1e} m (negative: never)")
    print(f"bytes to a neighbour and round: mean {np.mean(bytes_sent):.1f}, most {np.max(bytes_sent):.0f}")


if __name__ == "__main__":
    main()
