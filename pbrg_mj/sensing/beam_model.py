"""What a range sensor makes of the true ranges, one effect after the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.sensing.noise import SensorNoise


@dataclass(frozen=True)
class Draws:
    """The random numbers of one scan, the same ones whatever the parameters: each parameter changes what it says."""

    additive: np.ndarray  # (beams,) standard normal
    dropped: np.ndarray  # (beams,) uniform in [0, 1), as those below
    ratio: np.ndarray  # (beams,) standard normal
    strayed: np.ndarray
    stray: np.ndarray  # where between the limits an outlier lies


def draw(beams: int, random: np.random.Generator) -> Draws:
    """Draw for one scan of so many beams."""
    return Draws(
        additive=random.standard_normal(beams),
        dropped=random.random(beams),
        ratio=random.standard_normal(beams),
        strayed=random.random(beams),
        stray=random.random(beams),
    )


def noisy_scan(raw: np.ndarray, noise: SensorNoise, random: np.random.Generator) -> np.ndarray:
    """Return one scan (beams,) [m] as the sensor reports it: NaN where a beam returned nothing.

    In this order: additive and multiplicative Gaussian noise, quantisation, range limits, outliers, dropout. A raw -1
    (no hit) and a raw range at the maximum (the sensor's cutoff) give no point: none was seen. Outliers come from
    anywhere between the limits, whatever the beam hit, in the sensor's steps.
    """
    draws = draw(len(raw), random)
    gauss, chance = (draws.additive, draws.ratio), (draws.dropped, draws.strayed, draws.stray)
    limits = (noise.range_min, noise.range_max, float(noise.quantum))
    return _reported(raw, gauss, (noise.range_std, noise.range_ratio), chance, (noise.dropout, noise.outliers), limits)


@kernel
def _reported(raw, gauss, spread, chance, shares, limits):  # pragma: no cover - compiled
    additive, ratio = gauss
    dropped, strayed, stray = chance
    low, high, quantum = limits
    ranges = np.full(len(raw), np.nan)
    for k in range(len(raw)):
        if dropped[k] < shares[0]:
            continue
        if strayed[k] < shares[1]:
            seen = quantised(low + (high - low) * stray[k], quantum)
        elif low <= raw[k] < high:
            seen = quantised(raw[k] + spread[0] * additive[k] + spread[1] * raw[k] * ratio[k], quantum)
        else:
            continue
        if low <= seen < high:
            ranges[k] = seen
    return ranges


@kernel
def quantised(distance, quantum):  # pragma: no cover - compiled
    """Return the nearest whole multiple of `quantum` [m]; the distance as it is if that is 0."""
    return np.rint(distance / quantum) * quantum if quantum > 0.0 else distance
