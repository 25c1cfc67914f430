"""Rounds over a network with delay, loss and silent robots, in plain NumPy: the specification of `network_rounds`.

Messages are the robots' (z, zeta), or wave variables (scattering). On every link and for every component,
y_i = (z_i, zeta_i) is moved by 2 M (r_i - y_i), M = [[1, -1], [1, 0]], where r_i is robot i's end of a lossless line of
impedance eta. The robot sends a_i = (eta r_i + phi_i) / sqrt(2 eta) and hears b_i = (eta r_i - phi_i) / sqrt(2 eta),
phi_i = 2 M (y_i - r_i), so that

    r_i = (eta I + 2 M)^-1 (sqrt(2 eta) b_i + 2 M y_i),    a_i = sqrt(2 eta) r_i - b_i

and the update sees 2 r_i - y_i in place of y_k. docs/network.md derives it and says what it guarantees.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from pbrg_mj.governor.distributed.channel import NO_MESSAGE, Channel, LinkStates, reverse_links
from pbrg_mj.governor.distributed.equations import Message, update_robots
from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.problem.interface import Problem
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
    for t in range(rounds):
        now, y = before.round + t, np.stack([estimates.z, estimates.zeta])
        seen = links.held
        if not channel.impedance:
            _send(links, net, now, y[:, net.neighbours], (bad[t], silent[t]))
        _receive(links, net, channel, now, silent[t])
        if channel.impedance:
            seen, waves = line_ends(y[:, net.receiver], links.held, links.up, channel.impedance)
            _send(links, net, now, waves[:, reverse_links(net)], (bad[t], silent[t]))
        _count_hops(links, net, channel)
        heard = [[Message(*seen[:, e]) for e in net.links_to(i) if links.up[e]] for i in range(net.robots)]
        after = update_robots(problem, estimates, heard, flow)
        for new, old in zip(after, estimates, strict=True):
            new[links.holding] = old[links.holding]
        estimates = after
        links.age[:] += 1
    last = bad[-1].copy() if rounds else before.bad
    after = dataclasses.replace(links, round=before.round + rounds, bad=last)
    return estimates, after, np.sum(~silent, axis=0) * net.degree


def line_ends(y: np.ndarray, b: np.ndarray, up: np.ndarray, eta: float) -> tuple[np.ndarray, np.ndarray]:
    """Return what every robot's update sees at its end of every link, and the waves a that it sends, (2, E, N) each.

    `y` (2, E, N) are the estimates (z, zeta) of the robot at the end, `b` (2, E, N) the waves that it last heard, `up`
    (E,) whether there is a line; where there is none, r = y and nothing flows.
    """
    inverse = np.linalg.inv(eta * np.eye(2) + 2.0 * M)
    r = np.einsum("cd,den->cen", inverse, np.sqrt(2.0 * eta) * b + 2.0 * np.einsum("cd,den->cen", M, y))
    r, line = np.where(up[:, None], r, y), up[:, None]
    return 2.0 * r - y, np.where(line, np.sqrt(2.0 * eta) * r - b, np.sqrt(0.5 * eta) * y)


def _send(links: LinkStates, net: Network, now: int, sent: np.ndarray, events: tuple[np.ndarray, np.ndarray]) -> None:
    """Put on every link the pair of vectors `sent` (2, E, N) from its sender, with the sender's hop count."""
    bad, silent = events
    slot, sender = now % links.flight.shape[2], net.neighbours
    links.flight[:, :, slot] = sent
    links.flight_hops[:, slot] = np.where(silent[sender] | bad, NO_MESSAGE, links.hops[sender])


def _receive(links: LinkStates, net: Network, channel: Channel, now: int, silent: np.ndarray) -> None:
    """Hold on every link the message that comes in this round, if one comes; cut links that are silent for long."""
    link = np.arange(len(channel.delay))
    slot = (now - channel.delay) % links.flight.shape[2]
    arrived = (links.flight_hops[link, slot] != NO_MESSAGE) & ~silent[net.receiver]
    links.up[~arrived & (links.age - channel.delay >= channel.silent_after)] = False
    links.up[arrived] = True
    links.held[:, arrived] = links.flight[:, link, slot][:, arrived]
    links.held_hops[arrived] = links.flight_hops[link, slot][arrived]
    links.age[arrived] = channel.delay[arrived]


def _count_hops(links: LinkStates, net: Network, channel: Channel) -> None:
    """Count how many links ago some robot lost a neighbour; counts beyond n - 1 are echoes and die out."""
    n = net.robots
    lost = links.age - channel.delay >= channel.silent_after
    reported = np.where(links.up, links.held_hops + 1, np.where(lost, 0, n))
    for i in range(n):
        links.hops[i] = reported[net.links_to(i)].min(initial=n)
