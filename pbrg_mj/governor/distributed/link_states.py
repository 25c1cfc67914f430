"""What robots keep of the messages on their links from round to round.

A message carries two vectors of N = 4n + 2 numbers, a hop count (how many links ago some robot counted a neighbour as
lost, n for nobody known) and, where messages can overtake one another, the number of the round in which it was sent.
A robot keeps of each neighbour the message sent last; one that comes after a newer one is dropped.

The vectors are z and zeta, or with waves the sums of both components over ALL waves that the sender has sent on this
link, and how many those are. So a message that is lost or dropped takes nothing away: the next one that comes brings
all of its waves. Waves that have come and are not yet used are known by their sum and their number alone.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from pbrg_mj.team.channel import Channel
from pbrg_mj.team.network import Network

NO_MESSAGE = -1  # in place of a hop count: no message in this slot


@dataclass(frozen=True)
class LinkStates:
    """Memory of E directed links. The message sent in round t waits in slot t modulo D.

    The arrays of waves are empty where estimates are sent.
    """

    round: int  # the next one
    flight: np.ndarray  # (2, E, D, N) vectors of the messages on their way
    flight_hops: np.ndarray  # (E, D) int64 their hop counts; NO_MESSAGE where none was sent or it was lost
    flight_arrival: np.ndarray  # (E, D) int64 the rounds in which they arrive
    flight_waves: np.ndarray  # (E, D) int64 how many waves are in their sums
    last_arrival: np.ndarray  # (E,) int64 when the message sent last arrives
    held: np.ndarray  # (2, E, N) vectors of the message kept
    held_hops: np.ndarray  # (E,) int64 its hop count
    held_waves: np.ndarray  # (E,) int64 how many waves are in its sums
    age: np.ndarray  # (E,) int64 rounds since it was sent, or since the start while none has come
    up: np.ndarray  # (E,) bool: a message has come, and the neighbour is not lost
    bad: np.ndarray  # (E,) bool: the link was losing messages in the last round
    sent: np.ndarray  # (2, E, N) sum of the waves sent
    sent_waves: np.ndarray  # (E,) int64 how many
    unused: np.ndarray  # (2, E, N) sum of the waves that came and are not yet used
    unused_waves: np.ndarray  # (E,) int64 how many
    hops: np.ndarray  # (n,) int64 hop count of each robot, n: knows of nobody lost

    @classmethod
    def empty(cls, channel: Channel, robots: int) -> LinkStates:
        """Return links on which nothing was sent yet."""
        links, size = len(channel.delay), 4 * robots + 2
        slots = 1 + int(channel.longest.max(initial=0))
        waves = (2, links if channel.impedance else 0, size)
        return cls(
            round=0,
            flight=np.zeros((2, links, slots, size)),
            flight_hops=np.full((links, slots), NO_MESSAGE, dtype=np.int64),
            flight_arrival=np.zeros((links, slots), dtype=np.int64),
            flight_waves=np.zeros((links, slots), dtype=np.int64),
            last_arrival=np.zeros(links, dtype=np.int64),
            held=np.zeros((2, links, size)),
            held_hops=np.full(links, robots, dtype=np.int64),
            held_waves=np.zeros(links, dtype=np.int64),
            age=np.zeros(links, dtype=np.int64),
            up=np.zeros(links, dtype=bool),
            bad=np.zeros(links, dtype=bool),
            sent=np.zeros(waves),
            sent_waves=np.zeros(links, dtype=np.int64),
            unused=np.zeros(waves),
            unused_waves=np.zeros(links, dtype=np.int64),
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
        return self.age - channel.longest > channel.silent_after  # the last round has already aged them by one


def reverse_links(network: Network) -> np.ndarray:
    """Return the link in the other direction of every directed link, (E,)."""
    return np.lexsort((network.receiver, network.neighbours))
