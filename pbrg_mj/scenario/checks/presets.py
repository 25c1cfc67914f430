"""A preset's name of earlier versions, which promised what it does not do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pbrg_mj.scenario.diagnostics import Diagnostic
from pbrg_mj.scenario.schema.beam_presets import PRESETS
from pbrg_mj.scenario.schema.sensors import EARLIER_GENERIC


def earlier_preset(data: Mapping[str, Any]) -> Iterator[Diagnostic]:
    """Yield that `preset: none` of a scenario's data has beams; logs of earlier versions that say so still open."""
    beams = (data.get("sensors") or {}).get("beams") or {}
    if beams.get("preset") == EARLIER_GENERIC:
        yield Diagnostic(
            ("sensors", "beams", "preset"),
            "is none, an earlier name of `generic`, which has 72 beams; "
            f"allowed: one of generic, {', '.join(PRESETS)}; without beams: `robots: []`",
        )
