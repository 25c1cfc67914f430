"""What a range sensor makes of the true ranges, one effect after the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
    noisy = raw + noise.range_std * draws.additive + noise.range_ratio * raw * draws.ratio
    noisy = quantised(noisy, noise.quantum)
    ranges = np.where(_in_range(raw, noise) & _in_range(noisy, noise), noisy, np.nan)
    stray = quantised(noise.range_min + (noise.range_max - noise.range_min) * draws.stray, noise.quantum)
    ranges = np.where(draws.strayed < noise.outliers, stray, ranges)
    return np.where((draws.dropped >= noise.dropout) & _in_range(ranges, noise), ranges, np.nan)


def quantised(ranges: np.ndarray, quantum: float) -> np.ndarray:
    """Return the nearest whole multiples of `quantum` [m]; the ranges as they are if it is 0."""
    return np.round(ranges / quantum) * quantum if quantum else ranges


def _in_range(ranges: np.ndarray, noise: SensorNoise) -> np.ndarray:
    return (ranges >= noise.range_min) & (ranges < noise.range_max)
