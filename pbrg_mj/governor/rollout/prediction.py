"""A step of the rollout: Taylor's polynomial of the sampled team, one exchange with the neighbours for each term.

From tick to tick x = (p, xi) moves by x+ = x + w(x), w(x) = tick (A_c x + b m). With v_0 = x, v_1 = w(x) and
v_(i+1) = tick A_c v_i the state r ticks later is sum_i C(r, i) v_i (binomial theorem), exactly for r <= p if v_0 .. v_p
are known. Beyond, the sum is cut off after v_p: `bounds`. Each v_i takes one round, in which a robot tells its
neighbours its own four numbers of v_(i-1); the positions at all ticks of the step come from them.
"""

from __future__ import annotations

from pbrg_mj.governor.certificate.predictive import narrowed
from pbrg_mj.kernel import kernel


@kernel
def write_change(graph, before, m, gains, change):
    """Write w(x) to `change` (n, 4) of x, before (n or more, 4), or tick A_c v of a v where m (n, 2) is 0.

    `graph` is first (n + 1,), neighbours (links,), leader (n,); neighbours are rows of `before`. `gains` are alpha_r,
    leak, tick.
    """
    first, neighbours, leader = graph
    alpha_r, leak, tick = gains
    for j in range(len(change)):
        for axis in range(2):
            apart = turned = 0.0  # sum_k L_jk p_k and sum_k L_jk xi_k
            for e in range(first[j], first[j + 1]):
                k = neighbours[e]
                apart += before[j, axis] - before[k, axis]
                turned += before[j, 2 + axis] - before[k, 2 + axis]
            pull = alpha_r * leader[j] * (m[j, axis] - before[j, axis])
            change[j, axis] = tick * (turned - apart + pull)
            change[j, 2 + axis] = -tick * (apart + leak * turned)


@kernel
def write_states(weights, v, states):
    """Write the states (Q, n, 4) with `weights` (Q, p + 1) of v (p + 1, n, 4)."""
    for r in range(states.shape[0]):
        for j in range(states.shape[1]):
            for c in range(4):
                total = 0.0
                for i in range(len(v)):
                    total += weights[r, i] * v[i, j, c]
                states[r, j, c] = total


@kernel
def narrow_intervals(states, tick, half_spaces, team, rows, intervals):
    """Narrow the advances that robots allow, low and high (W, n), by states (Q, n, 4) at `tick`, `tick` + 1, ...

    `half_spaces` are those of `HalfSpaceArrays`: owner and binds_all (W,), G (W, 2), h (W,); `team` the numbers of the
    robots (n,), formation (n, 2) and margin; `rows` the hold, s (T, n), bound (T, n) and norm (W,) of ||e||. Ticks up
    to the hold ask for nothing.
    """
    owner, binds_all, G, h = half_spaces
    robots, formation, margin = team
    hold, s, bound, norm = rows
    low, high = intervals
    for w in range(len(h)):
        Gx, Gy = G[w, 0], G[w, 1]
        for j in range(len(robots)):
            if not (binds_all[w] or owner[w] == robots[j]):
                continue
            slack = h[w] - margin - (Gx * formation[j, 0] + Gy * formation[j, 1])
            down, up = low[w, j], high[w, j]
            for r in range(states.shape[0]):
                t = tick + r
                if t > hold:
                    rest = slack - (Gx * states[r, j, 0] + Gy * states[r, j, 1]) - bound[t, j] * norm[w]
                    step, spread = s[t - hold, j], bound[t - hold, j]
                    down, up = narrowed(down, up, rest, step, step + spread, step - spread)
            low[w, j], high[w, j] = down, up


@kernel
def narrow_by_terminal_bounds(held, half_spaces, team, bounds, intervals):
    """Narrow the advances by what comes after the last tick, under the m that is held (2,) [m].

    `bounds` are those from the start, from_start (n,), and from the hold on, from_hold (n,), and norm (W,) of ||e||;
    `half_spaces`, `team` and `intervals` as for `narrow_intervals`.
    """
    owner, binds_all, G, h = half_spaces
    robots, formation, margin = team
    from_start, from_hold, norm = bounds
    low, high = intervals
    for w in range(len(h)):
        Gx, Gy = G[w, 0], G[w, 1]
        for j in range(len(robots)):
            if binds_all[w] or owner[w] == robots[j]:
                slack = h[w] - margin - (Gx * formation[j, 0] + Gy * formation[j, 1])
                rest = slack - (Gx * held[0] + Gy * held[1]) - from_start[j] * norm[w]
                spread = from_hold[j]
                low[w, j], high[w, j] = narrowed(low[w, j], high[w, j], rest, 1.0, 1.0 + spread, 1.0 - spread)
