"""`pbrg doctor`: what works on this machine, and how to fix what does not."""

from __future__ import annotations

from typing import Annotated, Any

import typer

import pbrg_mj as pbrg
from pbrg_mj.cli.console import emit, emit_json


def doctor(
    json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
) -> int:
    """Show versions, cores, GL, caches, robots and parts: what works here, and how to fix what does not."""
    found = pbrg.doctor()
    if json:
        emit_json(found)
    else:
        emit("\n".join(_lines(found)))
    return 1 if any(version is None for version in found["required"].values()) else 0


def _lines(found: dict[str, Any]) -> list[str]:
    lines = [f"{'python':<30} {found['python']}", f"{'cores':<30} {found['cores']}"]
    lines += [f"{name:<30} {version or f'MISSING: pip install {name}'}" for name, version in found["required"].items()]
    lines += [
        f"{name:<30} {one['version'] or 'not installed; for ' + one['use'] + ': ' + one['fix']}"
        for name, one in found["optional"].items()
    ]
    for backend, one in found["gl"].items():
        fix = f"does not work ({one['error']}); on Debian: apt install {' '.join(one['packages'])}"
        lines.append(f"{'GL ' + backend:<30} {'works' if one['works'] else fix}")
    cache = found["numba_cache"]
    state = "writable" if cache["writable"] else "NOT writable: set NUMBA_CACHE_DIR to a folder of yours"
    lines.append(f"{'numba cache':<30} {cache['folder']}: {state}")
    for name, one in found["robots"].items():
        numbers = f"{one['mass_kg']:.2f} kg, {200 * one['radius_m']:.0f} cm, {one['top_speed_m_s']:.2f} m/s"
        lines.append(f"{'robot ' + name:<30} {one['description']} ({numbers})")
    for key, parts in found["parts"].items():
        names = (name if package == "pbrg-mj" else f"{name} ({package})" for name, package in parts.items())
        lines.append(f"{key:<30} {', '.join(names)}")
    return lines
