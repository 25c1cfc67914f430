"""The words in a picture: clock, margin, the governor's status."""

from __future__ import annotations

import numpy as np

from pbrg_mj.log.read.run import Run
from pbrg_mj.text import plain
from pbrg_mj.video.playback import latest

LONGEST = 48  # characters of a name


def caption(run: Run, time: float) -> tuple[str, str]:
    """Return the names and the values, a line each, that describe the run at `time` [s]; printable ASCII."""
    ticks, k = run.ticks, latest(run.ticks.time, time)
    facts = {"": _ascii(run.name), "time": f"{time:.2f} s"}
    margins = np.fmin(ticks.wall_margin[k], ticks.moving_margin[k])
    margin = float(margins.min(initial=np.inf))
    if np.isfinite(margin):
        robot = int(margins.argmin()) + 1
        facts["margin"] = f"{margin:.3f} m (robot {robot})"
    facts["governor"] = _ascii(str(ticks.status[k]))
    solved = latest(run.optima.time, time)
    if solved >= 0:
        facts["gap to m*"] = _gap(run, k, solved)
    contacts = {"a wall": ticks.wall_contact, "a moving box": ticks.moving_contact, "a robot": ticks.robot_contact}
    for what, flags in contacts.items():
        touching = np.flatnonzero(flags[k]) + 1
        if len(touching):
            facts[f"touches {what}"] = "robot " + ", ".join(map(str, touching.tolist()))
    return "\n".join(facts), "\n".join(facts.values())


def _gap(run: Run, tick: int, solved: int) -> str:
    """Return the distance of the leaders' mean reference from the latest optimum, or why there is none."""
    if run.optima.status[solved] != "solved":
        return _ascii(str(run.optima.status[solved]))
    leaders = [number - 1 for number in run.scenario.team.leaders]
    gap = run.ticks.m[tick, leaders].mean(axis=0) - run.optima.m[solved]
    return f"{float(np.linalg.norm(gap)):.3f} m"


def _ascii(text: str) -> str:
    """Return text that the bitmap font can show."""
    return plain(text).encode("ascii", "replace").decode()[:LONGEST]
