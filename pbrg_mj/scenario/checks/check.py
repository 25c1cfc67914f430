"""What must hold between the keys of a scenario."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import islice, pairwise

from pbrg_mj.scenario.checks.certificate import certificate
from pbrg_mj.scenario.checks.network import graph, messages
from pbrg_mj.scenario.checks.physics import physics
from pbrg_mj.scenario.checks.robot_numbers import robot_numbers
from pbrg_mj.scenario.checks.robots import robots
from pbrg_mj.scenario.checks.sampling import sampled_pre_stabiliser
from pbrg_mj.scenario.checks.separation import separation
from pbrg_mj.scenario.checks.work import physics_work, work
from pbrg_mj.scenario.checks.world import extents, placement
from pbrg_mj.scenario.diagnostics import Diagnostic, KeyPath, yaml_text
from pbrg_mj.scenario.schema import Scenario, Vector, whole_multiple

MOST_TICKS = 100_000_000  # eleven days at 10 ms, and a log of some 100 GB
MOST_STEPS = 10_000  # of physics in a tick
MOST_FINDINGS = 100  # of each check: robots all at one place are as many as there are pairs of them
LEAST_SLOTS = 4  # of points: what has no slot of its own is kept off by a box around the way


def check(scenario: Scenario) -> list[Diagnostic]:
    """Return all that is wrong between keys that are right one by one; empty for a good scenario."""
    lengths = list(_lengths(scenario))
    # Where the lists of the team differ in length, places of robots mean nothing.
    rest = (robot_numbers, _given, graph, _timing, _sensing, _operator, physics, robots, extents, messages, certificate)
    rest += (separation, work) if lengths else (separation, work, placement)
    found = lengths + [diagnostic for part in rest for diagnostic in islice(part(scenario), MOST_FINDINGS)]
    return found or list(sampled_pre_stabiliser(scenario))  # of a graph and leaders that are right


def _lengths(scenario: Scenario) -> Iterator[Diagnostic]:
    team, n = scenario.team, scenario.robots
    if len(team.formation) != n:
        yield Diagnostic(
            ("team", "formation"), f"has {len(team.formation)} entries; allowed: {n}, one per robot in team.start"
        )
    beams, camera = scenario.sensors.beams, scenario.sensors.camera
    one_or_all = {
        ("team", "heading_deg"): team.heading_deg,
        **{("team", "variation", name): getattr(team.variation, name) for name in type(team.variation).model_fields},
        ("sensors", "beams", "bias"): beams.bias,
        **{("sensors", "camera", name): getattr(camera, name) for name in ("bias_x", "bias_y", "heading_bias_deg")},
    }
    for path, given in one_or_all.items():
        if isinstance(given, tuple) and len(given) != n:
            yield Diagnostic(
                path, f"has {len(given)} entries; allowed: one number, or {n}, one per robot in team.start"
            )


def _given(scenario: Scenario) -> Iterator[Diagnostic]:
    for k, given in enumerate(scenario.estimator.given):
        if math.hypot(*given.normal) == 0:
            path = ("estimator", "given", k, "normal")
            yield Diagnostic(path, f"is {yaml_text(given.normal)}; allowed: any direction, not zero")


def _timing(scenario: Scenario) -> Iterator[Diagnostic]:
    timing = scenario.timing
    if scenario.plant == "physics":  # the ideal plant takes no physics steps
        found = list(_few(("timing", "tick"), timing.tick, "timing.physics_step", timing.physics_step, MOST_STEPS))
        yield from found or physics_work(scenario)
    yield from _few(("timing", "duration"), timing.duration, "timing.tick", timing.tick, MOST_TICKS)
    yield from _whole(("reference", "period"), scenario.reference.period, "timing.tick", timing.tick)


def _whole(path: KeyPath, period: float, name: str, step: float) -> Iterator[Diagnostic]:
    if whole_multiple(period, step) is None:
        yield Diagnostic(path, f"is {period} s; allowed: a whole multiple of {name}, {step} s")


def _few(path: KeyPath, period: float, name: str, step: float, most: int) -> Iterator[Diagnostic]:
    if period / step > most * (1 + 1e-9):
        yield Diagnostic(path, f"is {period:g} s; allowed: at most {most} times {name}, {step:g} s")
    else:
        yield from _whole(path, period, name, step)


def _sensing(scenario: Scenario) -> Iterator[Diagnostic]:
    beams, estimator = scenario.sensors.beams, scenario.estimator
    if beams.range_min >= beams.range_max:
        yield Diagnostic(
            ("sensors", "beams"),
            f"has range_min {beams.range_min} m; allowed: less than range_max, {beams.range_max} m",
        )
    if beams.scan_time * beams.rate_hz > 1 + 1e-9:
        yield Diagnostic(
            ("sensors", "beams", "scan_time"),
            f"is {beams.scan_time:g} s; allowed: at most {1 / beams.rate_hz:g} s, the time between scans",
        )
    yield from _radio(scenario.sensors.uwb.anchors)
    for k, occlusion in enumerate(scenario.sensors.camera.occlusions):
        if occlusion.time == 0:
            path = ("sensors", "camera", "occlusions", k, "time")
            yield Diagnostic(path, "is 0 s; allowed: later, when the robot has been seen")
    if estimator.unknown != "free" and estimator.source != "points":
        yield Diagnostic(("estimator", "unknown"), f"is {estimator.unknown}; allowed but with `source: points`: free")
    if estimator.source not in ("beams", "points"):
        return
    if scenario.plant == "ideal":
        yield Diagnostic(("plant",), "is ideal, which has no beams; allowed: with `estimator.source: given` only")
    elif estimator.given:
        yield Diagnostic(
            ("estimator", "given"),
            f"is given, but estimator.source is {estimator.source}; allowed: with `source: given`",
        )
    if estimator.source == "points" and estimator.half_spaces_per_robot < LEAST_SLOTS:
        yield Diagnostic(
            ("estimator", "half_spaces_per_robot"),
            f"is {estimator.half_spaces_per_robot}; allowed with `source: points`, which keeps all points: "
            f"{LEAST_SLOTS} or more",
        )
    if estimator.source == "points" and estimator.scope != "own":
        yield Diagnostic(
            ("estimator", "scope"),
            f"is {estimator.scope}; allowed with `source: points`, which keeps off the way of the robot that sees: own",
        )


def _radio(anchors: Sequence[Vector]) -> Iterator[Diagnostic]:
    path = ("sensors", "uwb", "anchors")
    if 0 < len(anchors) < 3:
        yield Diagnostic(path, f"has {len(anchors)} anchors; allowed: none, or three or more")
    elif anchors:
        (ax, ay), *others = anchors
        far = max(math.dist(anchors[0], one) for one in others)
        off = max(abs((x - ax) * (v - ay) - (y - ay) * (u - ax)) for x, y in others for u, v in others)
        if off <= 1e-3 * far * far:
            yield Diagnostic(path, f"is {yaml_text(anchors)}; allowed: places that are not on one line")


def _operator(scenario: Scenario) -> Iterator[Diagnostic]:
    operator = scenario.operator
    if (operator.reference is None) == (not operator.waypoints):
        both = "has both reference and waypoints" if operator.waypoints else "has neither reference nor waypoints"
        yield Diagnostic(("operator",), f"{both}; allowed: one of them")
    times = [waypoint.time for waypoint in operator.waypoints]
    if times and times[0] != 0:
        yield Diagnostic(
            ("operator", "waypoints", 0, "time"), f"is {times[0]} s; allowed: 0, the first waypoint's time"
        )
    for k, (before, after) in enumerate(pairwise(times), start=1):
        if after <= before:
            yield Diagnostic(
                ("operator", "waypoints", k, "time"), f"is {after} s; allowed: later than the one before, {before} s"
            )
