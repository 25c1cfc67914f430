"""A log read as a whole, and the warning of one that is damaged."""

from __future__ import annotations

import logging
from pathlib import Path

from pbrg_mj.log.read import run as reader

LOG = logging.getLogger("pbrg_mj")


def read_log(log: str | Path) -> reader.Run:
    """Read a log (.mcap), of a damaged one its leading whole part, and warn of the damage. Raises InputError."""
    recorded = reader.open_run(log)
    warn_if_damaged(recorded.damage, log)
    return recorded


def warn_if_damaged(damage: str | None, log: str | Path) -> None:
    """Warn of a log that ends early, unless `damage` is None."""
    if damage:
        LOG.warning("%s: %s", log, damage)
