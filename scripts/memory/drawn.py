"""Worlds drawn by seeds, for as long as it takes to come near something: what no scenario reads may be read there.

One of every bundled sensor, among things that move, with the recommended set-up. In that of seed 691 half-spaces once
were made of memory that nobody had written, 16.4 s from its start; in 140 other worlds none was.
"""

from __future__ import annotations

from typing import Any

from other_worlds.draw import scenario

KIND = "moving_robots"
DRAWN = {  # seed of the world: seed of its noise, duration [s]
    691: (5, 16.6),  # lds_02, e-puck2
    1161: (1, 8.0),  # tof_ring, e-puck2
    1163: (1, 8.0),  # robotarium, Khepera IV
    1166: (1, 8.0),  # lidar, Khepera IV
    1169: (1, 8.0),  # tof_cones, GRITSBot
    1176: (1, 8.0),  # generic, TurtleBot3 Burger
}


def drawn_worlds() -> dict[str, tuple[dict[str, Any], dict[str, Any]]]:
    """Return every world as a scenario with its overrides, by the name of its log."""
    return {
        f"{KIND}_{seed}": (
            scenario(KIND, seed),
            {"set_up": "recommended", "seed": noise, "timing.duration": duration},
        )
        for seed, (noise, duration) in DRAWN.items()
    }
