"""Rounds over a network with delay, loss and silent robots; messages are estimates or wave variables.

Scattering (wave variables): on every link and for every component, y_i = (z_i, zeta_i) is moved by 2 M (r_i - y_i),
M = [[1, -1], [1, 0]], where r_i is robot i's end of a lossless line of impedance eta. The robot sends
a_i = (eta r_i + phi_i) / sqrt(2 eta) and hears b_i = (eta r_i - phi_i) / sqrt(2 eta), phi_i = 2 M (y_i - r_i), so that

    r_i = (eta I + 2 M)^-1 (sqrt(2 eta) b_i + 2 M y_i),    a_i = sqrt(2 eta) r_i - b_i

and the update sees 2 r_i - y_i in place of y_k. docs/network.md derives it and says what it guarantees.
"""

from __future__ import annotations

import numpy as np

from pbrg_mj.governor.distributed.channel import NO_MESSAGE, Channel, LinkStates, reverse_links
from pbrg_mj.governor.distributed.rounds import Estimates, Flow, active_rows, update_robots
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.kernel import kernel


def run_network_rounds(
    problem: Problem, memory: tuple[Estimates, LinkStates], channel: Channel, flow: Flow, rounds: int
) -> tuple[Estimates, LinkStates, np.ndarray]:
    """Return the estimates and the links' memory after `rounds` rounds, and messages sent by each robot, (n,).

    A robot that counts a neighbour as lost, or hears of such a robot, holds its estimates; it goes on sending.
    """
    estimates, exchange = memory
    net, rows = problem.network, problem.rows
    bad = channel.lost(exchange.bad, exchange.round, rounds)
    silent = channel.silent(exchange.round, rounds, net.robots)
    links = exchange.copied()
    arrays = _run(
        (estimates.z, estimates.zeta, estimates.lam, estimates.nu),
        (links.flight, links.flight_hops, links.held, links.held_hops, links.age, links.up, links.hops),
        (net.first, net.leader, reverse_links(net), channel.delay, channel.silent_after, channel.impedance),
        (exchange.round, bad, silent),
        (problem.p, problem.xi, problem.reference, rows.a, rows.C, rows.d, rows.active),
        (flow.alpha, flow.step, flow.multiplier_cap),
    )
    after = LinkStates(
        exchange.round + rounds,
        *(links.flight, links.flight_hops, links.held, links.held_hops, links.age, links.up),
        bad=bad[-1].copy() if rounds else exchange.bad,
        hops=links.hops,
    )
    return Estimates(*arrays), after, np.sum(~silent, axis=0) * net.degree


@kernel
def _run(estimates, links, network, events, private, gains):  # pragma: no cover - compiled
    """Run len(bad) rounds; `links` change in place."""
    old = (estimates[0].copy(), estimates[1].copy(), estimates[2].copy(), estimates[3].copy())
    new = (estimates[0].copy(), estimates[1].copy(), estimates[2].copy(), estimates[3].copy())
    first, leader = network[0], network[1]
    start, bad, silent = events
    p, xi, r, a, C, d, active = private
    own = (leader, (p, xi, r), (a, C, d, active), active_rows(active))
    waves = network[5] > 0.0
    hops = links[6]
    seen = np.zeros_like(links[2]) if waves else links[2]
    heard_first, heard = np.zeros_like(first), np.zeros(len(bad[0]), dtype=np.int64)
    for t in range(len(bad)):
        if not waves:
            _send_estimates(old, links, network, start + t, (bad[t], silent[t]))
        _receive(links, network, start + t, silent[t])
        if waves:
            _send_waves(old, seen, links, network, start + t, (bad[t], silent[t]))
        _count_hops(links, network)
        _list_heard(first, links[5], heard_first, heard)
        new[2][:] = 0.0  # robots that held their estimates held multipliers of rows that are no more
        update_robots(old, new, (heard_first, heard, seen[0], seen[1]), own, gains)
        for i in range(len(leader)):
            if hops[i] < len(leader):
                _copy_row(old, new, i)
        links[4][:] += 1
        old, new = new, old
    return old


@kernel
def _copy_row(old, new, i):  # pragma: no cover - compiled
    new[0][i] = old[0][i]
    new[1][i] = old[1][i]
    new[2][i] = old[2][i]
    new[3][i] = old[3][i]


@kernel
def _list_heard(first, up, heard_first, heard):  # pragma: no cover - compiled
    """List the links that are up, robot after robot: those of robot i in heard[heard_first[i]:heard_first[i + 1]]."""
    count = 0
    for i in range(len(first) - 1):
        for e in range(first[i], first[i + 1]):
            if up[e]:
                heard[count] = e
                count += 1
        heard_first[i + 1] = count


@kernel
def _send_estimates(old, links, network, now, events):  # pragma: no cover - compiled
    flight, flight_hops, hops = links[0], links[1], links[6]
    first, reverse = network[0], network[2]
    bad, silent = events
    slot = now % flight.shape[2]
    for i in range(len(hops)):
        for e in range(first[i], first[i + 1]):
            out = reverse[e]
            flight[0, out, slot] = old[0][i]
            flight[1, out, slot] = old[1][i]
            flight_hops[out, slot] = NO_MESSAGE if silent[i] or bad[out] else hops[i]


@kernel
def _receive(links, network, now, silent):  # pragma: no cover - compiled
    """Hold on every link the message that comes in this round, if one comes; cut links that are silent for long."""
    flight, flight_hops, held, held_hops, age, up, _ = links
    first, delay, patience = network[0], network[3], network[4]
    for i in range(len(first) - 1):
        for e in range(first[i], first[i + 1]):
            slot = (now - delay[e]) % flight.shape[2]
            if flight_hops[e, slot] != NO_MESSAGE and not silent[i]:
                held[0, e] = flight[0, e, slot]
                held[1, e] = flight[1, e, slot]
                held_hops[e] = flight_hops[e, slot]
                age[e] = delay[e]
                up[e] = True
            elif age[e] - delay[e] >= patience:
                up[e] = False


@kernel
def _send_waves(old, seen, links, network, now, events):  # pragma: no cover - compiled
    """Solve every robot's end of every link: what the update sees, and the wave that is sent."""
    flight, flight_hops, held, up, hops = links[0], links[1], links[2], links[5], links[6]
    first, reverse, eta = network[0], network[2], network[5]
    bad, silent = events
    slot = now % flight.shape[2]
    root, det = np.sqrt(2.0 * eta), eta * eta + 2.0 * eta + 4.0  # det of eta I + 2 M
    for i in range(len(hops)):
        z, zeta = old[0][i], old[1][i]
        for e in range(first[i], first[i + 1]):
            out = reverse[e]
            flight_hops[out, slot] = NO_MESSAGE if silent[i] or bad[out] else hops[i]
            for c in range(len(z)):
                if not up[e]:  # no line yet, or no more: r_i = y_i, no flow
                    flight[0, out, slot, c] = np.sqrt(0.5 * eta) * z[c]
                    flight[1, out, slot, c] = np.sqrt(0.5 * eta) * zeta[c]
                    continue
                b, b_zeta = held[0, e, c], held[1, e, c]
                x = root * b + 2.0 * (z[c] - zeta[c])
                y = root * b_zeta + 2.0 * z[c]
                r = (eta * x + 2.0 * y) / det
                r_zeta = ((eta + 2.0) * y - 2.0 * x) / det
                seen[0, e, c] = 2.0 * r - z[c]
                seen[1, e, c] = 2.0 * r_zeta - zeta[c]
                flight[0, out, slot, c] = root * r - b
                flight[1, out, slot, c] = root * r_zeta - b_zeta


@kernel
def _count_hops(links, network):  # pragma: no cover - compiled
    """Count how many links ago some robot lost a neighbour; counts beyond n - 1 are echoes and die out."""
    held_hops, age, up, hops = links[3], links[4], links[5], links[6]
    first, delay, patience = network[0], network[3], network[4]
    n = len(hops)
    for i in range(n):
        nearest = n
        for e in range(first[i], first[i + 1]):
            if up[e]:
                nearest = min(nearest, held_hops[e] + 1)
            elif age[e] - delay[e] >= patience:
                nearest = 0
        hops[i] = nearest
