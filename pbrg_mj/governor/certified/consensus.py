"""Min-consensus on the steps kappa: each robot forwards the smallest received, and the robots that it covers.

The minimum is exact as soon as it stands for every robot; a message that comes twice, late or by two ways changes
nothing, for min and union are idempotent, commutative and associative.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

HEADER = struct.Struct("<Id?")  # cycle, kappa, whether some owner's rows forbid the held m


class Verdict(NamedTuple):
    """What some robots say together of a cycle's candidate."""

    cycle: int
    kappa: float  # the smallest of theirs
    forbidden: bool  # some owner's rows forbid the held m
    robots: int  # whom it stands for, a bit for each

    @classmethod
    def empty(cls, cycle: int) -> Verdict:
        """Return the verdict of nobody."""
        return cls(cycle, 1.0, forbidden=False, robots=0)

    def with_own(self, robot: int, kappa: float, forbidden: bool) -> Verdict:
        """Return the verdict with one robot's own."""
        return self.merged(Verdict(self.cycle, kappa, forbidden, 1 << robot))

    def merged(self, other: Verdict) -> Verdict:
        """Return what both say; a verdict of another cycle says nothing."""
        if other.cycle != self.cycle:
            return self
        return Verdict(
            self.cycle,
            min(self.kappa, other.kappa),
            self.forbidden or other.forbidden,
            self.robots | other.robots,
        )

    def complete(self, robots: int) -> bool:
        """Return whether it stands for all of so many robots."""
        return self.robots == (1 << robots) - 1

    def packed(self, robots: int) -> bytes:
        """Return the verdict as it is sent among so many robots."""
        return HEADER.pack(self.cycle, self.kappa, self.forbidden) + self.robots.to_bytes((robots + 7) // 8, "little")

    @classmethod
    def unpacked(cls, content: bytes) -> Verdict:
        """Return the verdict of a message."""
        cycle, kappa, forbidden = HEADER.unpack_from(content)
        return cls(cycle, kappa, forbidden, int.from_bytes(content[HEADER.size :], "little"))
