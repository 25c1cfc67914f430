"""Rounds over a network with delay, loss and silent robots, compiled: what `network_equations` specifies.

Python calls `_run` alone, with plain tuples; inside, everything has its name (see `rounds`).
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.distributed.channel import NO_MESSAGE, Channel, LinkStates, reverse_links
from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.distributed.rounds import Heard, private_data, round_arguments, update_robots
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.kernel import kernel


class LinkArrays(NamedTuple):
    """Arrays of `LinkStates`, which say their shapes; kernels write them."""

    flight: np.ndarray
    flight_hops: np.ndarray
    held: np.ndarray
    held_hops: np.ndarray
    age: np.ndarray
    up: np.ndarray
    hops: np.ndarray


class LinkParameters(NamedTuple):
    """The graph's links and how messages travel on them."""

    first: np.ndarray  # (n + 1,) int64, of `Network`
    reverse: np.ndarray  # (E,) int64, the link in the other direction
    delay: np.ndarray  # (E,) int64 rounds
    silent_after: int  # rounds
    impedance: float  # 0.0: estimates are sent as they are


def run_network_rounds(
    problem: Problem, memory: tuple[Estimates, LinkStates], channel: Channel, flow: Flow, rounds: int
) -> tuple[Estimates, LinkStates, np.ndarray]:
    """Return the estimates and the links' memory after `rounds` rounds, and messages sent by each robot, (n,).

    A robot that counts a neighbour as lost, or hears of such a robot, holds its estimates; it goes on sending.
    """
    estimates, before = memory
    net = problem.network
    bad = channel.lost(before.bad, before.round, rounds)
    silent = channel.silent(before.round, rounds, net.robots)
    links = before.copied()
    arrays = _run(
        round_arguments(problem, estimates, flow),
        tuple(getattr(links, name) for name in LinkArrays._fields),
        (net.first, reverse_links(net), channel.delay, channel.silent_after, channel.impedance),
        (before.round, bad, silent),
    )
    after = dataclasses.replace(links, round=before.round + rounds, bad=bad[-1].copy() if rounds else before.bad)
    return Estimates(*arrays), after, np.sum(~silent, axis=0) * net.degree


@kernel
def _run(arguments, link_arrays, link_parameters, events):
    """Run len(bad) rounds and return z, zeta, lam, nu; `link_arrays` change in place.

    `arguments` are the first five of `rounds.write_rounds`, `link_arrays` and `link_parameters` plain tuples of the
    members of their types, `events` the number of the first round, and for every round which links lose their messages,
    bad (rounds, E), and which robots are silent (rounds, n).
    """
    estimates, graph, states, rows, flow = arguments
    links, parameters, gains = LinkArrays(*link_arrays), LinkParameters(*link_parameters), Flow(*flow)
    start, bad, silent = events
    private = private_data(graph, states, rows)
    old = Estimates(estimates[0].copy(), estimates[1].copy(), estimates[2].copy(), estimates[3].copy())
    new = Estimates(estimates[0].copy(), estimates[1].copy(), estimates[2].copy(), estimates[3].copy())
    waves = parameters.impedance > 0.0
    seen = np.zeros_like(links.held) if waves else links.held
    heard = Heard(np.zeros_like(parameters.first), np.zeros(len(parameters.delay), dtype=np.int64), seen[0], seen[1])
    for t in range(len(bad)):
        if not waves:
            _send_estimates(old, links, parameters, start + t, bad[t], silent[t])
        _receive(links, parameters, start + t, silent[t])
        if waves:
            _send_waves(old, seen, links, parameters, start + t, bad[t], silent[t])
        _count_hops(links, parameters)
        _list_heard(parameters.first, links.up, heard)
        new.lam[:] = 0.0  # robots that held their estimates held multipliers of rows that are no more
        update_robots(old, new, heard, private, gains)
        for i in range(len(links.hops)):
            if links.hops[i] < len(links.hops):
                _copy_row(old, new, i)
        links.age[:] += 1
        old, new = new, old
    return old.z, old.zeta, old.lam, old.nu


@kernel
def _copy_row(old, new, i):
    new.z[i] = old.z[i]
    new.zeta[i] = old.zeta[i]
    new.lam[i] = old.lam[i]
    new.nu[i] = old.nu[i]


@kernel
def _list_heard(first, up, heard):
    """List the links that are up, robot after robot: as `Heard` wants them."""
    count = 0
    for i in range(len(first) - 1):
        for e in range(first[i], first[i + 1]):
            if up[e]:
                heard.which[count] = e
                count += 1
        heard.first[i + 1] = count


@kernel
def _send_estimates(old, links, parameters, now, bad, silent):
    flight, flight_hops, hops = links.flight, links.flight_hops, links.hops
    first, reverse = parameters.first, parameters.reverse
    slot = now % flight.shape[2]
    for i in range(len(hops)):
        for e in range(first[i], first[i + 1]):
            out = reverse[e]
            flight[0, out, slot] = old.z[i]
            flight[1, out, slot] = old.zeta[i]
            flight_hops[out, slot] = NO_MESSAGE if silent[i] or bad[out] else hops[i]


@kernel
def _receive(links, parameters, now, silent):
    """Hold on every link the message that comes in this round, if one comes; cut links that are silent for long."""
    flight, flight_hops, held, held_hops = links.flight, links.flight_hops, links.held, links.held_hops
    first, delay, age, up = parameters.first, parameters.delay, links.age, links.up
    for i in range(len(first) - 1):
        for e in range(first[i], first[i + 1]):
            slot = (now - delay[e]) % flight.shape[2]
            if flight_hops[e, slot] != NO_MESSAGE and not silent[i]:
                held[0, e] = flight[0, e, slot]
                held[1, e] = flight[1, e, slot]
                held_hops[e] = flight_hops[e, slot]
                age[e] = delay[e]
                up[e] = True
            elif age[e] - delay[e] >= parameters.silent_after:
                up[e] = False


@kernel
def _send_waves(old, seen, links, parameters, now, bad, silent):
    """Solve every robot's end of every link: what the update sees, and the wave that is sent."""
    flight, flight_hops, held, up, hops = links.flight, links.flight_hops, links.held, links.up, links.hops
    first, reverse, eta = parameters.first, parameters.reverse, parameters.impedance
    slot = now % flight.shape[2]
    root, det = np.sqrt(2.0 * eta), eta * eta + 2.0 * eta + 4.0  # det of eta I + 2 M
    for i in range(len(hops)):
        z, zeta = old.z[i], old.zeta[i]
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
def _count_hops(links, parameters):
    """Count how many links ago some robot lost a neighbour; counts beyond n - 1 are echoes and die out."""
    held_hops, age, up, hops = links.held_hops, links.age, links.up, links.hops
    first, delay = parameters.first, parameters.delay
    n = len(hops)
    for i in range(n):
        nearest = n
        for e in range(first[i], first[i + 1]):
            if up[e]:
                nearest = min(nearest, held_hops[e] + 1)
            elif age[e] - delay[e] >= parameters.silent_after:
                nearest = 0
        hops[i] = nearest
