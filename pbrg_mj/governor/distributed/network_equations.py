"""Rounds over a network with delay, loss and silent robots, in plain NumPy: the specification of `network_rounds`.

Messages are the robots' (z, zeta), or wave variables (scattering). On every link and for every component,
y_i = (z_i, zeta_i) is moved by 2 M (r_i - y_i), M = [[1, -1], [1, 0]], where r_i is robot i's end of a lossless line of
impedance eta. The robot sends a_i = (eta r_i + phi_i) / sqrt(2 eta) and uses b_i = (eta r_i - phi_i) / sqrt(2 eta),
phi_i = 2 M (y_i - r_i), so that

    r_i = (eta I + 2 M)^-1 (sqrt(2 eta) b_i + 2 M y_i),    a_i = sqrt(2 eta) r_i - b_i

and the update sees 2 r_i - y_i in place of y_k. The wave b_i is the mean of all waves that have come on the link and
are not used yet, and counts as one of them. A robot without a wave on some link makes no step in this round and sends
no new wave. docs/network.md derives both and says what they guarantee.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from pbrg_mj.governor.distributed.equations import Message, update_robots
from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.distributed.link_states import NO_MESSAGE, LinkStates, reverse_links
from pbrg_mj.governor.problem.interface import Problem
from pbrg_mj.team.channel import Channel
from pbrg_mj.team.network import Network

M = np.array([[1.0, -1.0], [1.0, 0.0]])


def run_network_rounds(
    problem: Problem, memory: tuple[Estimates, LinkStates], channel: Channel, flow: Flow, rounds: int
) -> tuple[Estimates, LinkStates, np.ndarray]:
    """Return the estimates and the links' memory after `rounds` rounds, and messages sent by each robot, (n,).

    A robot that counts a neighbour as lost, or hears of such a robot, holds its estimates; it goes on sending.
    """
    estimates, before = memory
    net, links = problem.network, before.copied()
    bad, silent = channel.lost(before.bad, before.round, rounds), channel.silent(before.round, rounds, net.robots)
    arrivals = channel.arrivals(before.last_arrival, before.round, rounds)
    for t in range(rounds):
        now, y = before.round + t, np.stack([estimates.z, estimates.zeta])
        seen, events = links.held, (arrivals[t], bad[t], silent[t])
        if not channel.impedance:
            _send(links, net, now, y[:, net.neighbours], events)
        _receive(links, net, channel, now, silent[t])
        hops = _count_hops(links, net, channel)
        moves = hops == net.robots
        if channel.impedance:
            moves &= ~_dry(links, net)
            seen = _use_waves(links, net, channel, y, moves)
            _send(links, net, now, links.sent, events)
        links.hops[:] = hops
        received = [[Message(*seen[:, e]) for e in net.links_to(i) if links.up[e]] for i in range(net.robots)]
        after = update_robots(problem, estimates, received, flow)
        for new, old in zip(after, estimates, strict=True):
            new[~moves] = old[~moves]
        estimates = after
        links.age[:] += 1
    last = {"bad": bad[-1].copy(), "last_arrival": arrivals[-1].copy()} if rounds else {}
    return (
        estimates,
        dataclasses.replace(links, round=before.round + rounds, **last),
        np.sum(~silent, axis=0) * net.degree,
    )


def line_ends(y: np.ndarray, b: np.ndarray, up: np.ndarray, eta: float) -> tuple[np.ndarray, np.ndarray]:
    """Return what every robot's update sees at its end of every link, and the waves a that it sends, (2, E, N) each.

    `y` (2, E, N) are the estimates (z, zeta) of the robot at the end, `b` (2, E, N) the waves that it uses, `up`
    (E,) whether there is a line; where there is none, r = y and nothing flows.
    """
    inverse = np.linalg.inv(eta * np.eye(2) + 2.0 * M)
    r = np.einsum("cd,den->cen", inverse, np.sqrt(2.0 * eta) * b + 2.0 * np.einsum("cd,den->cen", M, y))
    r, line = np.where(up[:, None], r, y), up[:, None]
    return 2.0 * r - y, np.where(line, np.sqrt(2.0 * eta) * r - b, np.sqrt(0.5 * eta) * y)


def _send(
    links: LinkStates, net: Network, now: int, vectors: np.ndarray, events: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> None:
    """Put on every link the pair of vectors (2, E, N) from its sender, with the sender's hop count."""
    arrivals, bad, silent = events
    slot, sender = now % links.flight.shape[2], net.neighbours
    links.flight[:, :, slot] = vectors
    links.flight_hops[:, slot] = np.where(silent[sender] | bad, NO_MESSAGE, links.hops[sender])
    links.flight_arrival[:, slot] = arrivals
    links.flight_waves[:, slot] = links.sent_waves


def _receive(links: LinkStates, net: Network, channel: Channel, now: int, silent: np.ndarray) -> None:
    """Keep on every link the newest message of this round unless a newer one is there; cut links silent for long."""
    link = np.arange(len(channel.delay))
    arrived = np.zeros(len(link), dtype=bool)
    for late in range(channel.jitter + 1):  # the newest first
        age = channel.delay + late
        slot = (now - age) % links.flight.shape[2]
        here = (links.flight_hops[link, slot] != NO_MESSAGE) & (links.flight_arrival[link, slot] == now)
        new = here & ~silent[net.receiver] & (age <= links.age) & ~arrived
        if channel.impedance:
            links.unused[:, new] += (links.flight[:, link, slot] - links.held)[:, new]
            links.unused_waves[new] += (links.flight_waves[link, slot] - links.held_waves)[new]
        links.held[:, new] = links.flight[:, link, slot][:, new]
        links.held_hops[new] = links.flight_hops[link, slot][new]
        links.held_waves[new] = links.flight_waves[link, slot][new]
        links.age[new] = age[new]
        arrived |= new
    links.up[~arrived & (links.age - channel.longest >= channel.silent_after)] = False
    links.up[arrived] = True


def _dry(links: LinkStates, net: Network) -> np.ndarray:
    """Return which robots have no wave to use on some link that is up, (n,) bool."""
    empty = links.up & (links.unused_waves == 0)
    return np.array([empty[net.links_to(i)].any() for i in range(net.robots)])


def _use_waves(links: LinkStates, net: Network, channel: Channel, y: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Use a wave and send one at the end of every link of the robots that move; return what their updates see."""
    here = moves[net.receiver]
    used = here & links.up
    count = np.where(used, links.unused_waves, 1)[:, None]
    b = np.where(used[:, None], links.unused / count, 0.0)
    seen, waves = line_ends(y[:, net.receiver], b, used, channel.impedance)
    links.unused[:] -= b
    links.unused_waves[used] -= 1
    out = reverse_links(net)
    copies = np.where(links.sent_waves[out] == 0, 1 + channel.reserve, 1) * here
    links.sent[:, out] += copies[:, None] * waves
    links.sent_waves[out] += copies
    return seen


def _count_hops(links: LinkStates, net: Network, channel: Channel) -> np.ndarray:
    """Return how many links ago some robot lost a neighbour, (n,); counts beyond n - 1 are echoes and die out."""
    n = net.robots
    lost = links.age - channel.longest >= channel.silent_after
    reported = np.where(links.up, links.held_hops + 1, np.where(lost, 0, n))
    return np.array([min(n, reported[net.links_to(i)].min(initial=n)) for i in range(n)], dtype=np.int64)
