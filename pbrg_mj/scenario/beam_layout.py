"""Where a robot's beams point, for those who send them out and those who read them."""

from __future__ import annotations

import numpy as np

from pbrg_mj.scenario.sensors import Beams


def beam_angles(beams: Beams) -> np.ndarray:
    """Return the directions (count,) [rad] of the beams from straight ahead, counter-clockwise, ascending.

    A sweep of 360 degrees spreads them evenly round the circle, the first beam's direction being met again by the
    beam after the last. Any other sweep reaches from the first beam to the last inclusive. One beam is the first.
    """
    count, sweep = beams.count, np.deg2rad(beams.sweep_deg)
    gaps = count if beams.sweep_deg == 360 else max(count - 1, 1)
    return np.deg2rad(beams.start_deg) + sweep * np.arange(count) / gaps
