"""Channels for the governor's tests, and their rounds written out with plain lists."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from pbrg_mj.governor.distributed.estimates import Estimates
from pbrg_mj.governor.distributed.link_states import LinkStates
from pbrg_mj.governor.distributed.network_rounds import run_network_rounds
from pbrg_mj.governor.distributed.rounds import run_rounds
from pbrg_mj.team.channel import Channel, Loss
from pbrg_mj.team.network import Network

M = np.array([[1.0, -1.0], [1.0, 0.0]])
FOREVER = 10**9


def links(network: Network) -> list[tuple[int, int]]:
    """(receiver, sender) of every directed link."""
    receiver = np.repeat(np.arange(network.robots), network.degree)
    return list(zip(receiver.tolist(), network.neighbours.tolist(), strict=True))


def channel(network, delay: int | Callable[[int, int], int] = 0, impedance=0.0, loss=None, **more) -> Channel:
    """`delay` is one number, or a function of the two ends of a link; `more` are other fields of Channel."""
    of = delay if callable(delay) else lambda i, k: delay
    delays = np.array([of(min(pair), max(pair)) for pair in links(network)], dtype=np.int64)
    outage_rounds = np.array(more.pop("outage_rounds", ()), np.int64).reshape(-1, 3)
    plain = Channel(delays, impedance, loss or Loss(), seed=1, outage_rounds=outage_rounds, silent_after=FOREVER)
    return dataclasses.replace(plain, **more)


NONE = np.zeros((0, 0), dtype=np.int64)


@dataclass(frozen=True)
class Scheduled(Channel):
    """A channel whose losses (T, E) and extra delays (T, E), 0 to `jitter` rounds, are given."""

    losses: np.ndarray = field(default_factory=lambda: NONE.astype(bool))
    extra: np.ndarray = field(default_factory=lambda: NONE)

    def lost(self, was_bad, first, rounds):
        return self.losses[first : first + rounds]

    def arrivals(self, last, first, rounds):
        due = np.arange(first, first + rounds)[:, None] + self.delay + self.extra[first : first + rounds]
        return np.maximum.accumulate(np.vstack([last, due]))[1:] if self.in_order else due


def scheduled(links_: Channel, losses, extra=None) -> Scheduled:
    """The same channel with these losses and extra delays."""
    extra = np.zeros(losses.shape, dtype=np.int64) if extra is None else extra
    late = dataclasses.replace(links_, jitter=int(extra.max(initial=0)))
    return Scheduled(*(getattr(late, one.name) for one in dataclasses.fields(Channel)), losses=losses, extra=extra)


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

    Every message and every wave is kept for ever; the line's two defining equations are solved as they stand. A robot's
    private part is a round without neighbours, held to the paper in test_governor_rounds.py.
    """
    net, n = problem.network, problem.network.robots
    alone = dataclasses.replace(problem, network=lonely(net))
    nothing = np.zeros(len(channel.delay), dtype=np.int64)
    lost, arrivals = channel.lost(nothing.astype(bool), 0, rounds), channel.arrivals(nothing, 0, rounds)
    eta = channel.impedance
    sent, newest = {pair: [] for pair in links(net)}, dict.fromkeys(links(net), -1)  # messages, and which is kept
    waves, used = {pair: [] for pair in links(net)}, {pair: [] for pair in links(net)}
    for t in range(rounds):
        y = np.stack([estimates.z, estimates.zeta], axis=1)  # (n, 2, N)
        if not eta:
            for i, k in sent:
                sent[i, k].append(y[k])
        for e, (i, k) in enumerate(links(net)):
            come = [s for s in range(len(sent[i, k])) if arrivals[s, e] == t and not lost[s, e]]
            newest[i, k] = max([newest[i, k], *come])
        unused = {pair: waves_until(sent, newest, pair) - len(used[pair]) for pair in links(net)} if eta else {}
        moves = [all(newest[i, k] < 0 or unused[i, k] > 0 for i, k in unused if i == robot) for robot in range(n)]
        moved = np.zeros_like(y)
        for i, k in links(net):
            if not eta:
                moved[i] += M @ (sent[i, k][newest[i, k]] - y[i]) if newest[i, k] >= 0 else 0.0
                continue
            if not moves[i]:
                continue
            r, wave = y[i], np.sqrt(eta / 2) * y[i]
            if newest[i, k] >= 0:
                came = sum(waves[i, k][: waves_until(sent, newest, (i, k))])
                b = (came - sum(used[i, k])) / unused[i, k]
                used[i, k].append(b)
                # two unknowns r, phi: phi = 2 M (y - r) and eta r - phi = sqrt(2 eta) b
                both = np.block([[2 * M, np.eye(2)], [eta * np.eye(2), -np.eye(2)]])
                r, phi = np.split(np.linalg.solve(both, np.vstack([2 * M @ y[i], np.sqrt(2 * eta) * b])), 2)
                wave = (eta * r + phi) / np.sqrt(2 * eta)
            moved[i] += 2 * M @ (r - y[i])
            waves[k, i] += [wave] * (1 if waves[k, i] else 1 + channel.reserve)
        if eta:
            for pair in sent:
                sent[pair].append(len(waves[pair]))
        private = run_rounds(alone, estimates, flow, 1)
        z, zeta = (getattr(private, name) + flow.step * moved[:, c] for c, name in enumerate(("z", "zeta")))
        after = Estimates(z, zeta, private.lam, private.nu)
        stays = ~np.array(moves)
        for new, old in zip(after, estimates, strict=True):
            new[stays] = old[stays]
        estimates = after
    return estimates


def waves_until(sent, newest, pair):
    """How many waves had been sent on a link with the message that is kept."""
    return sent[pair][newest[pair]] if newest[pair] >= 0 else 0


def lonely(network: Network) -> Network:
    """The same robots without links."""
    n = network.robots
    return Network(np.zeros((n, n)), np.zeros(n + 1, np.int64), np.zeros(0, np.int64), network.leader)
