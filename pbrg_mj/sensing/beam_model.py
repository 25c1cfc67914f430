"""What range sensors make of the true ranges, one effect after the other."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from pbrg_mj.kernel import kernel
from pbrg_mj.sensing.noise import BeamNumbers, SensorNoise


def noisy_scan(raw: np.ndarray, noise: SensorNoise, random: np.random.Generator) -> np.ndarray:
    """Return one scan (beams,) [m] of raw ranges (beams,); see `reported_scans`."""
    return reported_scans(raw[None], noise, beam_numbers((1, len(raw)), noise, [random]))[0]


def reported_scans(raw: np.ndarray, noise: SensorNoise, numbers: BeamNumbers) -> np.ndarray:
    """Return scans (b, beams) [m] as the sensors report them: NaN where a beam returned nothing.

    In this order: additive and multiplicative Gaussian noise, quantisation, range limits, outliers, dropout. A raw -1
    (no hit) and a raw range at the maximum (the sensor's cutoff) give no point: none was seen. Outliers come from
    anywhere between the limits, whatever the beam hit, in the sensor's steps. `numbers` are those of `beam_numbers`.
    """
    shares = (noise.dropout, noise.outliers)
    limits = (noise.range_min, noise.range_max, float(noise.quantum))
    return _reported(raw, numbers, (noise.range_std, noise.range_ratio), shares, limits)


def beam_numbers(shape: tuple[int, int], noise: SensorNoise, randoms: Iterable[np.random.Generator]) -> BeamNumbers:
    """Return the random numbers of scans (b, beams), of `randoms` row after row.

    In this order, whatever the parameters, so that each parameter changes only what it says; but what nothing depends
    on at the end is not drawn.
    """
    beams = shape[1]
    additive, dropped, ratio = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    outlier = np.zeros((shape[0], 2 * beams))  # whether it is an outlier, and where between the limits that lies
    any_outliers = noise.outliers > 0
    ratios = any_outliers or noise.range_ratio > 0
    drops = ratios or noise.dropout > 0
    for row, random in enumerate(randoms):
        random.standard_normal(out=additive[row])
        if drops:
            random.random(out=dropped[row])
        if ratios:
            random.standard_normal(out=ratio[row])
        if any_outliers:
            random.random(out=outlier[row])
    return additive, dropped, ratio, outlier


@kernel
def _reported(raw, drawn, spread, shares, limits):
    """Return the ranges (rows, beams) [m] that sensors report of the true ones, raw (rows, beams) [m].

    `drawn` are random numbers: additive and ratio (rows, beams), standard normal; dropped (rows, beams) and outlier
    (rows, 2 beams), uniform. `spread` (2,) are the additive standard deviation [m] and that per range, `shares` (2,)
    those of beams dropped and of outliers, `limits` low and high of ranges and their quantum [m].
    """
    additive, dropped, ratio, outlier = drawn
    low, high, quantum = limits
    beams = raw.shape[1]
    ranges = np.full(raw.shape, np.nan)
    for row in range(len(raw)):
        for k in range(beams):
            if dropped[row, k] < shares[0]:
                continue
            true = raw[row, k]
            if outlier[row, k] < shares[1]:
                seen = quantised(low + (high - low) * outlier[row, beams + k], quantum)
            elif low <= true < high:
                seen = quantised(true + spread[0] * additive[row, k] + spread[1] * true * ratio[row, k], quantum)
            else:
                continue
            if low <= seen < high:
                ranges[row, k] = seen
    return ranges


@kernel
def quantised(distance, quantum):
    """Return the nearest whole multiple of `quantum` [m]; the distance as it is if that is 0."""
    return np.rint(distance / quantum) * quantum if quantum > 0.0 else distance
