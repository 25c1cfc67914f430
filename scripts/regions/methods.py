"""All methods in one view: ours, safe flight corridors, IRIS."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from regions.corridor import corridor
from regions.measures import Region, Worth, worth
from regions.views import ROBOT, View, repeated

try:
    from regions import iris
except ModuleNotFoundError as missing:
    if (missing.name or "").split(".")[0] != "pydrake":
        raise
    iris = None

DRAKE = iris is not None
OURS, FINER, CORRIDOR = "half-spaces from points", "the same with 16 slots", "safe flight corridor"
ABOUT, ALONG = "IRIS, clusters, about the hand point", "IRIS, clusters, along the way"
TRUE_ABOUT, TRUE_ALONG = "IRIS, true solids, about the hand point", "IRIS, true solids, along the way"


class Row(NamedTuple):
    """One method in one view."""

    worth: Worth | None  # None: it found no region
    seconds: float  # of processor time; NaN: not taken


def rows(one: View) -> dict[str, Row]:
    """Return the figures of all methods in one view."""
    found = {}
    for name, (region, seconds) in regions(one).items():
        view = one.hand, one.target, one.reach
        found[name] = Row(None if region is None else worth(region, view, one.solids, ROBOT.clearance), seconds)
    return found


def regions(one: View) -> dict[str, tuple[Region | None, float]]:
    """Return the regions of all methods, and the processor time of each [s]."""
    found: dict[str, tuple[Region | None, float]] = {OURS: (one.ours, one.seconds), FINER: (one.finer, np.nan)}
    for name, method in _others(one):
        region: list[Region | None] = []
        seconds = repeated([lambda method=method, region=region: region.append(method())])
        found[name] = region[0], seconds
    return found


def _others(one: View) -> Iterator[tuple[str, Callable[[], Region | None]]]:
    """Yield the methods beside ours."""
    yield CORRIDOR, lambda: corridor(one.places.at, one.places.insets, one.path)
    if iris is None:
        return
    within = iris.domain(one.hand, one.reach)
    clusters = iris.of_clusters(one.places, one.clusters, one.path)
    solids = iris.of_solids(one.solids, ROBOT.clearance, (one.hand, one.reach))
    yield ABOUT, lambda: iris.about(clusters, one.hand, within)
    yield ALONG, lambda: iris.along(clusters, one.path, within)
    yield TRUE_ABOUT, lambda: iris.about(solids, one.hand, within)
    yield TRUE_ALONG, lambda: iris.along(solids, one.path, within)
