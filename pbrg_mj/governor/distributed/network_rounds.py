"""Rounds over a network with delay, loss and silent robots, compiled: what `network_equations` specifies.

Python calls `_run` alone, with plain tuples; inside, everything has its name (see `rounds`).
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np

from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.distributed.link_states import NO_MESSAGE, LinkStates, reverse_links
from pbrg_mj.governor.distributed.rounds import ReceivedStates, private_data, round_arguments, update_robots
from pbrg_mj.governor.distributed.waves import exchange_waves, put_sums
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.kernel import kernel
from pbrg_mj.team.channel import Channel


class LinkArrays(NamedTuple):
    """Arrays of `LinkStates`, which say their shapes; kernels write them."""

    flight: np.ndarray
    flight_hops: np.ndarray
    flight_arrival: np.ndarray
    flight_waves: np.ndarray
    held: np.ndarray
    held_hops: np.ndarray
    held_waves: np.ndarray
    age: np.ndarray
    up: np.ndarray
    sent: np.ndarray
    sent_waves: np.ndarray
    unused: np.ndarray
    unused_waves: np.ndarray
    hops: np.ndarray


class LinkParameters(NamedTuple):
    """The graph's links and how messages travel on them."""

    first: np.ndarray  # (n + 1,) int64, of `Network`
    reverse: np.ndarray  # (E,) int64, the link in the other direction
    delay: np.ndarray  # (E,) int64 rounds
    jitter: int  # rounds
    silent_after: int  # rounds
    impedance: float  # 0.0: estimates are sent as they are
    reserve: int  # waves


class Events(NamedTuple):
    """What happens to messages in one round."""

    now: int  # its number
    arrivals: np.ndarray  # (E,) int64 rounds in which the messages sent now arrive
    bad: np.ndarray  # (E,) bool: they are lost
    silent: np.ndarray  # (n,) bool: robots that neither send nor hear


def run_network_rounds(
    problem: Problem, memory: tuple[Estimates, LinkStates], channel: Channel, flow: Flow, rounds: int
) -> tuple[Estimates, LinkStates, np.ndarray]:
    """Return the estimates and the links' memory after `rounds` rounds, and messages sent by each robot, (n,).

    A robot that counts a neighbour as lost, or hears of such a robot, holds its estimates; it goes on sending.
    """
    estimates, before = memory
    net, start = problem.network, before.round
    arrivals, bad = channel.arrivals(before.last_arrival, start, rounds), channel.lost(before.bad, start, rounds)
    silent = channel.silent(start, rounds, net.robots)
    links = before.copied()
    arrays = _run(
        round_arguments(problem, estimates, flow),
        tuple(getattr(links, name) for name in LinkArrays._fields),
        (
            *(net.first, reverse_links(net), channel.delay, channel.jitter),
            *(channel.silent_after, channel.impedance, channel.reserve),
        ),
        (start, arrivals, bad, silent),
    )
    last = {"bad": bad[-1].copy(), "last_arrival": arrivals[-1].copy()} if rounds else {}
    after = dataclasses.replace(links, round=start + rounds, **last)
    return Estimates(*arrays), after, np.sum(~silent, axis=0) * net.degree


@kernel
def _run(arguments, link_arrays, link_parameters, events):
    """Run len(bad) rounds and return z, zeta, lam, nu; `link_arrays` change in place.

    `arguments` are the first five of `rounds.write_rounds`: estimates (z, zeta, lam, nu), graph, states, rows, flow.
    `link_arrays` and `link_parameters` are plain tuples of the members of their types. `events` are the number of the
    first round, start, and for each of T rounds those of `Events`: arrivals (T, E), bad (T, E), silent (T, n).
    """
    estimates, graph, states, rows, flow = arguments
    links, parameters, gains = LinkArrays(*link_arrays), LinkParameters(*link_parameters), Flow(*flow)
    start, arrivals, bad, silent = events
    private = private_data(graph, states, rows)
    old = Estimates(estimates[0].copy(), estimates[1].copy(), estimates[2].copy(), estimates[3].copy())
    new = Estimates(estimates[0].copy(), estimates[1].copy(), estimates[2].copy(), estimates[3].copy())
    waves = parameters.impedance > 0.0
    seen = np.zeros_like(links.held) if waves else links.held
    received = ReceivedStates(
        np.zeros_like(parameters.first), np.zeros(len(parameters.delay), dtype=np.int64), seen[0], seen[1]
    )
    hops, moves = np.empty_like(links.hops), np.empty(len(links.hops), dtype=np.bool_)
    for t in range(len(bad)):
        now = Events(start + t, arrivals[t], bad[t], silent[t])
        if not waves:
            _put_estimates(old, links, parameters, now)
            _send(links, parameters, now)
        _receive(links, parameters, now)
        _count_hops(links, parameters, hops)
        _list_movers(links, parameters, hops, moves)
        if waves:
            exchange_waves(old, seen, links, parameters, moves)
            put_sums(links, parameters, now)
            _send(links, parameters, now)
        links.hops[:] = hops
        _list_received(parameters.first, links.up, received)
        new.lam[:] = 0.0  # robots that held their estimates held multipliers of rows that are no more
        update_robots(old, new, received, private, gains)
        for i in range(len(moves)):
            if not moves[i]:
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
def _list_received(first, up, received):
    """List the links that are `up` (E,), robot after robot by `first` (n + 1,): as `ReceivedStates` wants them."""
    count = 0
    for i in range(len(first) - 1):
        for e in range(first[i], first[i + 1]):
            if up[e]:
                received.which[count] = e
                count += 1
        received.first[i + 1] = count


@kernel
def _list_movers(links, parameters, hops, moves):
    """Write to `moves` (n,) which robots step.

    It is those that know of nobody lost, by their `hops` (n,), and, with waves, have one to use on every link.
    """
    first, up, unused_waves = parameters.first, links.up, links.unused_waves
    waves = parameters.impedance > 0.0
    for i in range(len(hops)):
        moves[i] = hops[i] == len(hops)
        for e in range(first[i], first[i + 1] if waves else first[i]):
            moves[i] &= not up[e] or unused_waves[e] > 0


@kernel
def _put_estimates(old, links, parameters, now):
    flight, first, reverse = links.flight, parameters.first, parameters.reverse
    slot = now.now % flight.shape[2]
    for i in range(len(links.hops)):
        for e in range(first[i], first[i + 1]):
            flight[0, reverse[e], slot] = old.z[i]
            flight[1, reverse[e], slot] = old.zeta[i]


@kernel
def _send(links, parameters, now):
    """Send what was put on every link, with the sender's hop count."""
    flight_hops, flight_arrival, hops = links.flight_hops, links.flight_arrival, links.hops
    first, reverse = parameters.first, parameters.reverse
    slot = now.now % flight_hops.shape[1]
    for i in range(len(hops)):
        for e in range(first[i], first[i + 1]):
            out = reverse[e]
            flight_hops[out, slot] = NO_MESSAGE if now.silent[i] or now.bad[out] else hops[i]
            flight_arrival[out, slot] = now.arrivals[out]


@kernel
def _receive(links, parameters, now):
    """Keep on every link the newest message of this round unless a newer one is there; cut links silent for long."""
    first, delay, age, up = parameters.first, parameters.delay, links.age, links.up
    for i in range(len(first) - 1):
        for e in range(first[i], first[i + 1]):
            arrived, slot, late = False, 0, 0
            if not now.silent[i]:
                for late in range(parameters.jitter + 1):  # the newest first
                    slot = (now.now - delay[e] - late) % links.flight.shape[2]
                    here = links.flight_hops[e, slot] != NO_MESSAGE and links.flight_arrival[e, slot] == now.now
                    if delay[e] + late > age[e] or here:
                        arrived = here and delay[e] + late <= age[e]
                        break
                if arrived:
                    _keep(links, parameters, e, slot)
                    age[e] = delay[e] + late
                    up[e] = True
            if not arrived and age[e] - delay[e] - parameters.jitter >= parameters.silent_after:
                up[e] = False


@kernel
def _keep(links, parameters, e, slot):
    """Keep the message of a slot; waves in its sum that were not in the sum kept before are there to be used."""
    flight, held, unused = links.flight, links.held, links.unused
    if parameters.impedance > 0.0:
        for c in range(held.shape[2]):
            unused[0, e, c] += flight[0, e, slot, c] - held[0, e, c]
            unused[1, e, c] += flight[1, e, slot, c] - held[1, e, c]
        links.unused_waves[e] += links.flight_waves[e, slot] - links.held_waves[e]
    held[0, e] = flight[0, e, slot]
    held[1, e] = flight[1, e, slot]
    links.held_hops[e] = links.flight_hops[e, slot]
    links.held_waves[e] = links.flight_waves[e, slot]


@kernel
def _count_hops(links, parameters, hops):
    """Count how many links ago some robot lost a neighbour, hops (n,).

    Counts beyond n - 1 are echoes and die out.
    """
    held_hops, age, up = links.held_hops, links.age, links.up
    first, delay = parameters.first, parameters.delay
    n = len(hops)
    for i in range(n):
        nearest = n
        for e in range(first[i], first[i + 1]):
            if up[e]:
                nearest = min(nearest, held_hops[e] + 1)
            elif age[e] - delay[e] - parameters.jitter >= parameters.silent_after:
                nearest = 0
        hops[i] = nearest
