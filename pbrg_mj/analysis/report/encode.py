"""Numbers and text, packed so that they can stand inside a page."""

from __future__ import annotations

import json
from base64 import b64encode
from math import prod
from typing import Any

import numpy as np

# Inside <script> only "<" can end the element; the others keep old readers of the page from going astray.
ESCAPED = {ord(c): f"\\u{ord(c):04x}" for c in "<>&"}


def packed(values: np.ndarray) -> dict[str, Any]:
    """Return `values` (F, ...) as base64 of little-endian floats of 32 bits, and how many belong to a row.

    Seven digits: a micrometre in ten metres. What is not finite, or too large for 32 bits, becomes NaN: not drawn.
    """
    with np.errstate(over="ignore"):
        single = np.asarray(values, dtype=float).astype("<f4")
    single[~np.isfinite(single)] = np.nan
    return {"width": prod(single.shape[1:]), "data": b64encode(single.tobytes()).decode()}


def embedded(data: Any) -> str:
    """Return `data` as JSON for a <script> element: ASCII, and nothing in it that could end the element."""
    text = json.dumps(data, allow_nan=False, sort_keys=True, separators=(",", ":"))
    return text.translate(ESCAPED)
