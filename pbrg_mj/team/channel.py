"""What happens to messages on the directed links of the graph: delay, loss, silent robots. Parameters, all in rounds.

Nothing here looks into a message or knows who takes it: `link_states` is what robots keep of what comes.

Link e brings messages to robot i from robot `neighbours[e]`, for e in `first[i]` .. `first[i + 1]` of the network.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pbrg_mj.scenario.random_streams import Source, stream
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.scenario.schema.network import Outage
from pbrg_mj.team.graph import network
from pbrg_mj.team.network import Network

NEVER = np.iinfo(np.int64).max
BLOCK = 16  # rounds whose random numbers are drawn at once; part of what a seed means, so it must never change
EMPTY_RESERVE_SHARE = 1e-3  # of the rounds in which a link may have used up the default reserve

HOPS = 2  # bytes of a message's hop count
NUMBER = 4  # bytes of its sequence number, or of a count of waves


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

    def longest_run(self) -> int:
        """Return the least K for which more than K losses in a row end in at most EMPTY_RESERVE_SHARE of the rounds.

        0 where everything is lost.
        """
        if self.share <= EMPTY_RESERVE_SHARE or self.stay == 1.0:
            return 0
        return 1 if self.stay == 0.0 else int(np.ceil(np.log(EMPTY_RESERVE_SHARE / self.share) / np.log(self.stay)))


@dataclass(frozen=True)
class Channel:
    """How messages travel on the E directed links of one network."""

    delay: np.ndarray  # (E,) int64: rounds from sending to use; 0: received in the round in which it is sent
    impedance: float  # of the waves, then every delay is at least 1; 0: estimates are sent as they are
    loss: Loss
    seed: int
    outage_rounds: np.ndarray  # (S, 3) int64: robot, first silent round, first round after
    silent_after: int  # rounds without a message after which a neighbour counts as lost
    jitter: int = 0  # most rounds by which a message takes longer than `delay`
    in_order: bool = False  # a message waits for those sent before it, as in a queue
    sources: tuple[Source, Source] = (Source.MESSAGES, Source.JITTER)  # what draws losses, and jitter
    reserve: int = 0  # waves sent beyond the first at the start, for rounds in which none comes

    @property
    def longest(self) -> np.ndarray:
        """The longest that a message may take on every directed link, (E,) int64 rounds."""
        return self.delay + self.jitter

    @property
    def header(self) -> int:
        """Bytes of a message beside its vectors.

        A sequence number where messages can overtake one another, and with waves how many are in the sum.
        """
        return HOPS + NUMBER * (self.jitter > 0) + NUMBER * (self.impedance > 0.0)

    def arrivals(self, last: np.ndarray, first: int, rounds: int) -> np.ndarray:
        """Return when messages sent in rounds first .. first + rounds - 1 arrive, (rounds, E) int64 rounds.

        `last` (E,) is when those of the round before the first arrive. The random numbers of a round depend on nothing
        but the seed and the round.
        """
        due = np.arange(first, first + rounds)[:, None] + self.delay
        if self.jitter == 0:
            return due
        draws = _uniform(self.seed, self.sources[1], first, rounds, len(self.delay))
        due += (draws * (self.jitter + 1)).astype(np.int64)
        return np.maximum.accumulate(np.vstack([last, due]))[1:] if self.in_order else due

    def lost(self, was_bad: np.ndarray, first: int, rounds: int) -> np.ndarray:
        """Return which messages sent in rounds first .. first + rounds - 1 are lost, (rounds, E).

        `was_bad` (E,) is the state of the links in the round before the first. The random numbers of a round depend on
        nothing but the seed and the round.
        """
        bad = np.zeros((rounds, len(self.delay)), dtype=bool)
        if self.loss.share == 0.0:
            return bad
        draws = _uniform(self.seed, self.sources[0], first, rounds, len(self.delay))
        for t, draw in enumerate(draws):
            chance = np.where(was_bad, self.loss.stay, self.loss.enter) if first + t > 0 else self.loss.share
            was_bad = bad[t] = draw < chance
        return bad

    def silent(self, first: int, rounds: int, robots: int) -> np.ndarray:
        """Return who neither sends nor hears in rounds first .. first + rounds - 1, (rounds, n)."""
        silent = np.zeros((rounds, robots), dtype=bool)
        for robot, start, end in self.outage_rounds:
            silent[max(start - first, 0) : max(end - first, 0), robot] = True
        return silent


def channel(scenario: Scenario) -> Channel | None:
    """Return how the messages of a scenario travel; None when every message arrives within its round.

    Expects a scenario that passed its checks: links that exist, waves with delay.
    """
    settings, team = scenario.network, network(scenario)
    waves = settings.exchange == "scattering"
    delayed = settings.delay_rounds > 0 or any(link.delay_rounds > 0 for link in settings.links)
    if not (waves or delayed or settings.jitter_rounds > 0 or settings.loss > 0 or settings.outages):
        return None
    per_second = scenario.governor.rounds / scenario.timing.tick
    burst = settings.loss_burst
    loss = Loss.independent(settings.loss) if burst is None else Loss.bursty(settings.loss, burst)
    silent_after = max(1, _first_round(settings.neighbour_timeout * per_second))
    reserve = settings.reserve_rounds
    return Channel(
        delay=_delays(scenario, team),
        impedance=settings.impedance if waves else 0.0,
        loss=loss,
        seed=scenario.seed,
        outage_rounds=outage_rounds(settings.outages, per_second),
        silent_after=silent_after,
        jitter=settings.jitter_rounds,
        in_order=not settings.reordering,
        reserve=min(settings.jitter_rounds + loss.longest_run(), silent_after) if reserve is None else reserve,
    )


def _delays(scenario: Scenario, team: Network) -> np.ndarray:
    """Return the delay of every directed link, (E,): the team's, or the one stated for both directions of a link."""
    own = {frozenset(k - 1 for k in link.robots): link.delay_rounds for link in scenario.network.links}
    pairs = zip(team.receiver.tolist(), team.neighbours.tolist(), strict=True)
    return np.array([own.get(frozenset(pair), scenario.network.delay_rounds) for pair in pairs], dtype=np.int64)


def outage_rounds(outages: Sequence[Outage], per_second: float) -> np.ndarray:
    """Return robot, first silent round and first round after of all outages, (S, 3), of so many rounds a second."""
    rows = []
    for silence in outages:
        start = _first_round(silence.time * per_second)
        end = NEVER if silence.duration is None else _first_round((silence.time + silence.duration) * per_second)
        rows.append((silence.robot - 1, start, end))
    return np.array(rows, dtype=np.int64).reshape(-1, 3)


def _first_round(count: float) -> int:
    """Return the first whole round at or after `count` rounds; what rounding of the clock adds is left out."""
    return min(int(np.ceil(count - 1e-6)), NEVER)


def _uniform(seed: int, source: Source, first: int, rounds: int, links: int) -> np.ndarray:
    """Return uniform numbers in [0, 1) of the given rounds, (rounds, links); a diverged governor runs none."""
    if rounds == 0:
        return np.empty((0, links))
    blocks = range(first // BLOCK, (first + rounds - 1) // BLOCK + 1)
    drawn = np.concatenate([stream(seed, source, 0, block).random((BLOCK, links)) for block in blocks])
    return drawn[first - BLOCK * blocks.start :][:rounds]
