"""How far each certificate was from holding, and how often it did not, over a run's ticks a block at a time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pbrg_mj.analysis.metrics.per_tick import CertificateRows
from pbrg_mj.governor.certificate.description import describe
from pbrg_mj.governor.certificate.evaluate import NAMES, VIOLATED
from pbrg_mj.log.read.run import TickSeries
from pbrg_mj.scenario.schema import Scenario

PREFIXES = {name: "certificate" if name == "ball" else name for name in NAMES}  # of the metrics


class CertificateTotals:
    """The worst value and the violated share of each certificate; NaN where it is not known at a tick."""

    def __init__(self, scenario: Scenario):
        self._scenario, self._rows = scenario, CertificateRows(scenario)
        self._worst = np.full(len(NAMES), -np.inf)
        self._violated = np.zeros(len(NAMES))
        self._ticks = 0

    def add(self, ticks: TickSeries) -> None:
        """Take the next ticks, one or more."""
        rows = self._rows(ticks, self._scenario)
        self._worst = np.maximum(self._worst, rows.max(axis=0))
        self._violated += np.count_nonzero(rows > VIOLATED, axis=0)
        self._ticks += len(rows)

    def fields(self) -> dict[str, Any]:
        """Return the metrics by name; keys of the ball are plain `certificate`."""
        own = describe(self._scenario)
        known = np.where(np.isnan(self._worst), np.nan, self._violated / self._ticks)
        shares: dict[str, float] = dict(zip(NAMES, known.tolist(), strict=True))
        found = {f"{PREFIXES[name]}_worst_m": worst for name, worst in zip(NAMES, self._worst.tolist(), strict=True)}
        found |= {f"{PREFIXES[name]}_violated_share": share for name, share in shares.items()}
        return found | {
            "own_certificate": own.name,
            "own_certificate_violated_share": shares.get(own.name or "", math.nan),
            "own_certificate_horizon_s": own.horizon_s,
        }
