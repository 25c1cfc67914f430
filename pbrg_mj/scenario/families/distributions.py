"""Values from their distributions.

Everything is made of uniform doubles from counting generators and rounded to six digits: the same on every machine.
"""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import Any
from zlib import crc32

import numpy as np

from pbrg_mj.scenario.families.schema import Distribution, Drawn
from pbrg_mj.scenario.random_streams import Source, stream
from pbrg_mj.scenario.schema import Section

CUT = 3.0  # standard deviations of a normal distribution
TAIL = NormalDist().cdf(-CUT)


def random_of(seed: int, name: str, index: int = 0) -> np.random.Generator:
    """Return the generator of one entry of `draw`: others may be added without a change in this one's numbers."""
    return stream(seed, Source.WORLDS, crc32(name.encode()), index)


def value(drawn: Drawn | Any, random: np.random.Generator) -> Any:
    """Return a constant itself, or one value of a distribution."""
    if not isinstance(drawn, Distribution):
        return drawn
    u = random.random()  # in [0, 1)
    if drawn.choice is not None:
        return drawn.choice[int(u * len(drawn.choice))]
    if drawn.integer is not None:
        low, high = drawn.integer
        return low + int(u * (high - low + 1))
    if drawn.uniform is not None:
        low, high = drawn.uniform
        return _rounded(low + (high - low) * u)
    if drawn.log_uniform is not None:
        low, high = map(math.log, drawn.log_uniform)
        return _rounded(math.exp(low + (high - low) * u))
    mean, std = drawn.normal or (0.0, 0.0)
    return _rounded(mean + std * NormalDist().inv_cdf(TAIL + (1 - 2 * TAIL) * u))


def values(section: Section, random: np.random.Generator, leave: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return a value for each of the section's keys, in their order."""
    names = (name for name in type(section).model_fields if name not in leave)
    return {name: value(getattr(section, name), random) for name in names}


def _rounded(number: float) -> float:
    return float(f"{number:.6g}")
