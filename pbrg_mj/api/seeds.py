"""Seeds as users write them: `1-8,20`."""

from __future__ import annotations

import re

from pbrg_mj.errors import InputError

MOST = 100_000  # seeds in one go


def seeds_of(text: str, what: str = "--seeds") -> tuple[int, ...]:
    """Return the seeds that `1-8,20` names, in that order. Raises InputError for anything else."""
    seeds: dict[int, None] = {}
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d{1,19})(?:-(\d{1,19}))?\s*", part)
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (1, 0)
        if not first <= last < 2**63 or last - first >= MOST or len(seeds) + last - first >= MOST:
            allowed = f"allowed: seeds and ranges such as 1-64 or 1-8,20, at most {MOST} in all"
            raise InputError(f"{what} is {text!r}; {allowed}")
        seeds.update(dict.fromkeys(range(first, last + 1)))
    return tuple(seeds)
