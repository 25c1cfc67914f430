"""What robots hear of their neighbours' p and xi where the pre-stabiliser's messages are late or lost.

Once a tick every robot sends (p, xi), `STATE` bytes, on each of its links. A robot keeps of each neighbour what was
sent last; a link on which nothing has come yet does not exist for it. What happens to the messages is a `Channel` of
ticks.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pbrg_mj.scenario.random_streams import Source
from pbrg_mj.scenario.schema import Control, Scenario
from pbrg_mj.team.channel import NEVER, Channel, Loss, outage_rounds
from pbrg_mj.team.graph import network
from pbrg_mj.team.network import Network

NOT_RECEIVED = -1  # in place of the tick in which a message was sent
STATE = 32  # of p and xi [bytes]


class ExchangeMemory(NamedTuple):
    """Messages under way, in D slots by the tick of their sending, and what was kept of those that came."""

    tick: int  # the next one
    sent: np.ndarray  # (D, n, 4) p, xi [m]
    arrives: np.ndarray  # (D, E) int64 ticks; NEVER for a message that was lost
    received: np.ndarray  # (E, 4) p, xi of the sender [m]
    received_tick: np.ndarray  # (E,) int64 the tick of its sending; NOT_RECEIVED
    last_arrival: np.ndarray  # (E,) int64 when the message of the tick before arrives
    bad: np.ndarray  # (E,) bool: the link was losing messages in the last tick


@dataclass(frozen=True)
class Exchange:
    """The pre-stabiliser's messages on one network."""

    network: Network
    channel: Channel  # whose rounds are ticks

    def empty(self) -> ExchangeMemory:
        """Return links on which nothing was sent yet."""
        links, slots = len(self.network.neighbours), 1 + int(self.channel.longest.max(initial=0))
        return ExchangeMemory(
            tick=0,
            sent=np.zeros((slots, self.network.robots, 4)),
            arrives=np.full((slots, links), NEVER),
            received=np.zeros((links, 4)),
            received_tick=np.full(links, NOT_RECEIVED),
            last_arrival=np.full(links, NOT_RECEIVED),
            bad=np.zeros(links, dtype=bool),
        )

    def transmitted(self, p: np.ndarray, xi: np.ndarray, before: ExchangeMemory) -> ExchangeMemory:
        """Return what robots keep after they have sent p and xi, both (n, 2) [m], and taken what comes in this tick."""
        net, channel, now = self.network, self.channel, before.tick
        lost, silent = channel.lost(before.bad, now, 1)[0], channel.silent(now, 1, net.robots)[0]
        arrives, slots = channel.arrivals(before.last_arrival, now, 1)[0], len(before.sent)
        sent, under_way = before.sent.copy(), before.arrives.copy()
        sent[now % slots] = np.hstack([p, xi])
        under_way[now % slots] = np.where(lost | silent[net.neighbours], NEVER, arrives)
        when = now - (now - np.arange(slots)) % slots  # the tick that each slot is of
        here = (under_way == now) & ~silent[net.receiver]
        newest = np.where(here, when[:, None], NOT_RECEIVED).max(axis=0)
        new = newest > before.received_tick
        came = sent[newest % slots, net.neighbours]
        return ExchangeMemory(
            tick=now + 1,
            sent=sent,
            arrives=under_way,
            received=np.where(new[:, None], came, before.received),
            received_tick=np.where(new, newest, before.received_tick),
            last_arrival=arrives,
            bad=lost,
        )

    def rates(
        self, control: Control, state: tuple[np.ndarray, np.ndarray], m: np.ndarray, received: ExchangeMemory
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return u and dxi/dt of eq. 2, both (n, 2) [m/s], of own p and xi and what was received of the neighbours'."""
        net, here = self.network, received.received_tick != NOT_RECEIVED
        own = np.hstack(state)
        apart = np.zeros_like(own)  # sums over k of L_jk p_k and L_jk xi_k
        np.add.at(apart, net.receiver[here], own[net.receiver[here]] - received.received[here])
        of_p, of_xi = apart[:, :2], apart[:, 2:]
        pull = control.alpha_r * net.leader[:, None] * (m - state[0])
        return of_xi - of_p + pull, -(of_p + control.leak * of_xi)


def exchange(scenario: Scenario) -> Exchange | None:
    """Return how the pre-stabiliser's messages of a scenario travel; None when all arrive within their tick."""
    settings, team = scenario.network.pre_stabiliser, network(scenario)
    if not (settings.delay_ticks or settings.jitter_ticks or settings.loss or settings.outages):
        return None
    burst = settings.loss_burst
    channel = Channel(
        delay=np.full(len(team.neighbours), settings.delay_ticks, dtype=np.int64),
        impedance=0.0,
        loss=Loss.independent(settings.loss) if burst is None else Loss.bursty(settings.loss, burst),
        seed=scenario.seed,
        outage_rounds=outage_rounds(settings.outages, 1.0 / scenario.timing.tick),
        silent_after=NEVER,
        jitter=settings.jitter_ticks,
        in_order=not settings.reordering,
        sources=(Source.PRE_STABILISER_MESSAGES, Source.PRE_STABILISER_JITTER),
    )
    return Exchange(team, channel)


class StateMessages(NamedTuple):
    """What robots send of p and xi, whether or not all of it arrives."""

    degree: np.ndarray  # (n,) links
    channel: Channel | None  # None: nobody is ever silent

    @classmethod
    def of(cls, scenario: Scenario) -> StateMessages:
        """Return those of a scenario."""
        lines = exchange(scenario)
        return cls(network(scenario).degree, lines.channel if lines else None)

    def sent(self, first: int, ticks: int) -> np.ndarray:
        """Return what each robot sends in all [bytes] in ticks first .. first + ticks - 1, (ticks, n)."""
        sent = np.tile(STATE * self.degree, (ticks, 1))
        return sent if self.channel is None else np.where(self.channel.silent(first, ticks, len(self.degree)), 0, sent)
