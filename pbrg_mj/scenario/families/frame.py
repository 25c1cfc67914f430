"""The frame of the team's path: from the team's centre at the start towards the reference."""

from __future__ import annotations

import math
from dataclasses import dataclass

DECIMALS = 4  # tenths of a millimetre


@dataclass(frozen=True)
class PathFrame:
    """Turned by `direction_deg` against the world, at the same origin."""

    direction_deg: float

    def to_world(self, along: float, across: float) -> list[float]:
        """Return the point [x, y] in the world [m]."""
        turn = math.radians(self.direction_deg)
        x = along * math.cos(turn) - across * math.sin(turn)
        y = along * math.sin(turn) + across * math.cos(turn)
        return [round(x, DECIMALS), round(y, DECIMALS)]

    def heading_to_world(self, angle_deg: float) -> float:
        """Return the angle in the world [deg], from -180 to 180."""
        return round((self.direction_deg + angle_deg + 180.0) % 360.0 - 180.0, DECIMALS)
