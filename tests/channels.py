"""Channels for the governor's tests, and their rounds written out with plain lists."""

from __future__ import annotations

import dataclasses

import numpy as np

from pbrg_mj.governor.distributed.channel import Channel, LinkStates, Loss
from pbrg_mj.governor.distributed.estimates import Estimates
from pbrg_mj.governor.distributed.network_rounds import run_network_rounds
from pbrg_mj.governor.distributed.rounds import run_rounds
from pbrg_mj.team.network import Network

M = np.array([[1.0, -1.0], [1.0, 0.0]])
FOREVER = 10**9


def links(network: Network) -> list[tuple[int, int]]:
    """(receiver, sender) of every directed link."""
    receiver = np.repeat(np.arange(network.robots), network.degree)
    return list(zip(receiver.tolist(), network.neighbours.tolist(), strict=True))


def channel(network, delay=0, impedance=0.0, loss=None, **more) -> Channel:
    """`delay` is one number, or a function of the two ends of a link; `more` are other fields of Channel."""
    of = delay if callable(delay) else lambda i, k: delay
    delays = np.array([of(min(pair), max(pair)) for pair in links(network)], dtype=np.int64)
    silences = np.array(more.pop("silences", ()), np.int64).reshape(-1, 3)
    plain = Channel(delays, impedance, loss or Loss(), seed=1, silences=silences, silent_after=FOREVER)
    return dataclasses.replace(plain, **more)


def uneven(i, k):
    """Delays of 1 to 4 rounds that differ from link to link."""
    return 1 + (3 * i + k) % 4


def quiet(channel, estimates):
    return estimates, LinkStates.empty(channel, len(estimates.z))


def run(problem, memory, channel, flow, rounds):
    """(Estimates, LinkStates) after some rounds."""
    return run_network_rounds(problem, memory, channel, flow, rounds)[:2]


def naive(problem, estimates, channel, flow, rounds):
    """The estimates after some rounds with nobody silent.

    Every message is kept for ever; waves by solving the line's two defining equations. A robot's private part is a
    round without neighbours, held to the paper in test_governor_rounds.py.
    """
    net, n = problem.network, problem.network.robots
    alone = dataclasses.replace(problem, network=lonely(net))
    lost = channel.lost(np.zeros(len(channel.delay), dtype=bool), 0, rounds)
    sent, held = {pair: [] for pair in links(net)}, {}
    eta = channel.impedance
    for t in range(rounds):
        y = np.stack([estimates.z, estimates.zeta], axis=1)  # (n, 2, N)
        if not eta:
            for i, k in sent:
                sent[i, k].append(y[k])
        for e, (i, k) in enumerate(links(net)):
            come = t - channel.delay[e]
            if come >= 0 and not lost[come, e]:
                held[i, k] = sent[i, k][come]
        moved = np.zeros_like(y)
        for i, k in links(net):
            if not eta:
                moved[i] += M @ (held[i, k] - y[i]) if (i, k) in held else 0.0
                continue
            r, wave = y[i], np.sqrt(eta / 2) * y[i]
            if (i, k) in held:
                # two unknowns r, phi: phi = 2 M (y - r) and eta r - phi = sqrt(2 eta) b
                both = np.block([[2 * M, np.eye(2)], [eta * np.eye(2), -np.eye(2)]])
                r, phi = np.split(np.linalg.solve(both, np.vstack([2 * M @ y[i], np.sqrt(2 * eta) * held[i, k]])), 2)
                wave = (eta * r + phi) / np.sqrt(2 * eta)
            moved[i] += 2 * M @ (r - y[i])
            sent[k, i].append(wave)
        private = run_rounds(alone, estimates, flow, 1)
        z, zeta = (getattr(private, name) + flow.step * moved[:, c] for c, name in enumerate(("z", "zeta")))
        estimates = Estimates(z, zeta, private.lam, private.nu)
    assert n == len(estimates.z)
    return estimates


def lonely(network: Network) -> Network:
    """The same robots without links."""
    n = network.robots
    return Network(np.zeros((n, n)), np.zeros(n + 1, np.int64), np.zeros(0, np.int64), network.leader)
