"""What happens to messages on the directed links of the graph: delay, loss, silent robots. Parameters, all in rounds.

Link e brings messages to robot i from robot `neighbours[e]`, for e in `first[i]` .. `first[i + 1]` of the network.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from pbrg_mj.scenario.random_streams import Source, stream
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.graph import network
from pbrg_mj.team.network import Network

NEVER = np.iinfo(np.int64).max
BLOCK = 16  # rounds whose random numbers are drawn at once; part of what a seed means, so it must never change


@dataclass(frozen=True)
class Loss:
    """Gilbert and Elliott's chain on every link: a message is lost while its link is bad."""

    share: float = 0.0  # of rounds in the bad state: the loss in the long run, and how a link starts
    enter: float = 0.0  # probability that a good link is bad in the next round
    stay: float = 0.0  # probability that a bad link stays bad

    @classmethod
    def independent(cls, share: float) -> Loss:
        """Return the loss that forgets: every message is lost with the same probability."""
        return cls(share, share, share)

    @classmethod
    def bursty(cls, share: float, burst: float) -> Loss:
        """Return the loss with runs of `burst` rounds on average, geometrically distributed; share < 1."""
        return cls(share, share / ((1.0 - share) * burst), 1.0 - 1.0 / burst)


@dataclass(frozen=True)
class Channel:
    """How messages travel on the E directed links of one network."""

    delay: np.ndarray  # (E,) int64: rounds from sending to use; 0: heard in the round in which it is sent
    impedance: float  # of the waves, then every delay is at least 1; 0: estimates are sent as they are
    loss: Loss
    seed: int
    silences: np.ndarray  # (S, 3) int64: robot, first silent round, first round after
    silent_after: int  # a neighbour not heard for this many rounds counts as lost

    def lost(self, was_bad: np.ndarray, first: int, rounds: int) -> np.ndarray:
        """Return which messages sent in rounds first .. first + rounds - 1 are lost, (rounds, E).

        `was_bad` (E,) is the state of the links in the round before the first. The random numbers of a round depend on
        nothing but the seed and the round.
        """
        bad = np.zeros((rounds, len(self.delay)), dtype=bool)
        if self.loss.share == 0.0:
            return bad
        draws = _uniform(self.seed, first, rounds, len(self.delay))
        for t, draw in enumerate(draws):
            chance = np.where(was_bad, self.loss.stay, self.loss.enter) if first + t > 0 else self.loss.share
            was_bad = bad[t] = draw < chance
        return bad

    def silent(self, first: int, rounds: int, robots: int) -> np.ndarray:
        """Return who neither sends nor hears in rounds first .. first + rounds - 1, (rounds, n)."""
        silent = np.zeros((rounds, robots), dtype=bool)
        for robot, start, end in self.silences:
            silent[max(start - first, 0) : max(end - first, 0), robot] = True
        return silent


def channel(scenario: Scenario) -> Channel | None:
    """Return how the messages of a scenario travel; None when every message arrives within its round.

    Expects a scenario that passed its checks: links that exist, waves with delay.
    """
    settings, team = scenario.network, network(scenario)
    waves = settings.exchange == "scattering"
    delayed = settings.delay_rounds > 0 or any(link.delay_rounds > 0 for link in settings.links)
    if not (waves or delayed or settings.loss > 0 or settings.outages):
        return None
    per_second = scenario.governor.rounds / scenario.timing.tick
    burst = settings.loss_burst
    return Channel(
        delay=_delays(scenario, team),
        impedance=settings.impedance if waves else 0.0,
        loss=Loss.independent(settings.loss) if burst is None else Loss.bursty(settings.loss, burst),
        seed=scenario.seed,
        silences=_silences(scenario, per_second),
        silent_after=max(1, _first_round(settings.neighbour_timeout * per_second)),
    )


def _delays(scenario: Scenario, team: Network) -> np.ndarray:
    """Return the delay of every directed link, (E,): the team's, or the one stated for both directions of a link."""
    own = {frozenset(k - 1 for k in link.robots): link.delay_rounds for link in scenario.network.links}
    pairs = zip(team.receiver.tolist(), team.neighbours.tolist(), strict=True)
    return np.array([own.get(frozenset(pair), scenario.network.delay_rounds) for pair in pairs], dtype=np.int64)


def _silences(scenario: Scenario, per_second: float) -> np.ndarray:
    rows = []
    for silence in scenario.network.outages:
        start = _first_round(silence.time * per_second)
        end = NEVER if silence.duration is None else _first_round((silence.time + silence.duration) * per_second)
        rows.append((silence.robot - 1, start, end))
    return np.array(rows, dtype=np.int64).reshape(-1, 3)


def _first_round(count: float) -> int:
    """Return the first whole round at or after `count` rounds; what rounding of the clock adds is left out."""
    return min(int(np.ceil(count - 1e-6)), NEVER)


def _uniform(seed: int, first: int, rounds: int, links: int) -> np.ndarray:
    """Return uniform numbers in [0, 1) of the given rounds, (rounds, links)."""
    blocks = range(first // BLOCK, (first + rounds - 1) // BLOCK + 1)
    drawn = np.concatenate([stream(seed, Source.MESSAGES, 0, block).random((BLOCK, links)) for block in blocks])
    return drawn[first - BLOCK * blocks.start :][:rounds]


NO_MESSAGE = -1  # in place of a hop count: no message in this slot


@dataclass(frozen=True)
class LinkStates:
    """Memory of E directed links; N = 4n + 2.

    A message is a pair (z, zeta), or the two components of a wave, and a hop count: how many links ago some robot
    counted a neighbour as lost, n for nobody known. The message sent in round t waits in slot t modulo D.
    """

    round: int  # the next one
    flight: np.ndarray  # (2, E, D, N) messages on their way
    flight_hops: np.ndarray  # (E, D) int64 their hop counts; NO_MESSAGE where none was sent or it was lost
    held: np.ndarray  # (2, E, N) the last message that came
    held_hops: np.ndarray  # (E,) int64 its hop count
    age: np.ndarray  # (E,) int64 rounds since it was sent, or since the start while none has come
    up: np.ndarray  # (E,) bool: a message has come, and the neighbour is not lost
    bad: np.ndarray  # (E,) bool: the link was losing messages in the last round
    hops: np.ndarray  # (n,) int64 hop count of each robot, n: knows of nobody lost

    @classmethod
    def empty(cls, channel: Channel, robots: int) -> LinkStates:
        """Return links on which nothing was sent yet."""
        links, size = len(channel.delay), 4 * robots + 2
        slots = 1 + int(channel.delay.max(initial=0))
        return cls(
            round=0,
            flight=np.zeros((2, links, slots, size)),
            flight_hops=np.full((links, slots), NO_MESSAGE, dtype=np.int64),
            held=np.zeros((2, links, size)),
            held_hops=np.full(links, robots, dtype=np.int64),
            age=np.zeros(links, dtype=np.int64),
            up=np.zeros(links, dtype=bool),
            bad=np.zeros(links, dtype=bool),
            hops=np.full(robots, robots, dtype=np.int64),
        )

    def copied(self) -> LinkStates:
        """Return the same memory in arrays of its own."""
        arrays = {f.name: getattr(self, f.name).copy() for f in dataclasses.fields(self) if f.name != "round"}
        return dataclasses.replace(self, **arrays)

    @property
    def holding(self) -> np.ndarray:
        """Which robots hold their estimates because they know of a lost robot, (n,) bool."""
        return self.hops < len(self.hops)

    def lost_links(self, channel: Channel) -> np.ndarray:
        """Return which links bring messages of a neighbour that counts as lost, (E,) bool."""
        return self.age - channel.delay > channel.silent_after  # the last round has already aged them by one


def reverse_links(network: Network) -> np.ndarray:
    """Return the link in the other direction of every directed link, (E,)."""
    return np.lexsort((network.receiver, network.neighbours))
