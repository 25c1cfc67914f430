"""What the links of a network remember between rounds: messages on their way, and what each robot last heard."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.channel import Channel
from pbrg_mj.team.network import Network

NOTHING = -1  # in place of a hop count: no message in this slot


@dataclass(frozen=True)
class Exchange:
    """Memory of E directed links; N = 4n + 2.

    A message is a pair (z, zeta), or the two components of a wave, and a hop count: how many links ago some robot
    counted a neighbour as lost, n for nobody known. The message sent in round t waits in slot t modulo D.
    """

    round: int  # the next one
    flight: np.ndarray  # (2, E, D, N) messages on their way
    flight_hops: np.ndarray  # (E, D) int64 their hop counts; NOTHING where none was sent or it was lost
    held: np.ndarray  # (2, E, N) the last message that came
    held_hops: np.ndarray  # (E,) int64 its hop count
    age: np.ndarray  # (E,) int64 rounds since it was sent, or since the start while none has come
    up: np.ndarray  # (E,) bool: a message has come, and the neighbour is not lost
    bad: np.ndarray  # (E,) bool: the link was losing messages in the last round
    hops: np.ndarray  # (n,) int64 hop count of each robot, n: knows of nobody lost

    @classmethod
    def quiet(cls, channel: Channel, robots: int) -> Exchange:
        """Return links on which nothing was sent yet."""
        links, size = len(channel.delay), 4 * robots + 2
        slots = 1 + int(channel.delay.max(initial=0))
        return cls(
            round=0,
            flight=np.zeros((2, links, slots, size)),
            flight_hops=np.full((links, slots), NOTHING, dtype=np.int64),
            held=np.zeros((2, links, size)),
            held_hops=np.full(links, robots, dtype=np.int64),
            age=np.zeros(links, dtype=np.int64),
            up=np.zeros(links, dtype=bool),
            bad=np.zeros(links, dtype=bool),
            hops=np.full(robots, robots, dtype=np.int64),
        )

    def copied(self) -> Exchange:
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
    receiver = np.repeat(np.arange(network.robots), network.degree)
    return np.lexsort((receiver, network.neighbours))
