"""Keys that mean something in the physics plant alone, and what must hold between them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from pbrg_mj.scenario.diagnostics import Diagnostic, yaml_text
from pbrg_mj.scenario.schema import LONGEST_PHYSICS_STEP, Scenario

LONGEST_DELAY = 10.0  # [s]
PHYSICS_ONLY: tuple[tuple[str, ...], ...] = (
    ("team", "variation", "mass"),
    ("team", "variation", "motor_constant"),
    ("team", "variation", "wheel_radius"),
    ("team", "variation", "friction"),
    ("world", "moving_boxes"),
    ("world", "floor_friction"),
    ("world", "rolling_resistance"),
    ("world", "patches"),
    ("world", "thresholds"),
    ("world", "ramps"),
    ("sensors", "camera", "delay"),
    ("sensors", "camera", "lost_frames"),
    ("sensors", "camera", "occlusions"),
    ("sensors", "camera", "swaps"),
    ("sensors", "uwb", "anchors"),
    ("sensors", "odometry", "fuse"),
    ("drive", "kind"),
    ("drive", "pwm_levels"),
    ("drive", "friction"),
    ("drive", "friction_compensation"),
    ("radio", "delay"),
    ("radio", "jitter"),
    ("disturbances", "pushes"),
    ("disturbances", "dead_motors"),
    ("disturbances", "kidnappings"),
)


def physics(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield what the ideal plant would ignore; in physics, delays and disturbances that cannot be."""
    if scenario.plant == "ideal":
        yield from _ignored(scenario)
        return
    if scenario.drive.friction_compensation and scenario.drive.kind != "voltage":
        yield Diagnostic(("drive", "friction_compensation"), "is true; allowed: with `drive.kind: voltage` alone")
    yield from _delays(scenario)
    yield from _durations(scenario)
    yield from _kidnappings(scenario)


def stable_step(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield a physics step at which the robots' wheels diverge."""
    step = scenario.timing.physics_step
    if scenario.plant == "physics" and step > LONGEST_PHYSICS_STEP:
        yield Diagnostic(("timing", "physics_step"), f"is {step} s; allowed: at most {LONGEST_PHYSICS_STEP} s")


def _ignored(scenario: Scenario) -> Iterator[Diagnostic]:
    for path in PHYSICS_ONLY:
        *sections, key = path
        section = scenario
        for name in sections:
            section = getattr(section, name)
        value = getattr(section, key)
        if value != type(section).model_fields[key].default:
            what = "given" if isinstance(value, tuple) else yaml_text(value)
            yield Diagnostic(path, f"is {what}, which the ideal plant ignores; allowed: with `plant: physics`")


def _delays(scenario: Scenario) -> Iterator[Diagnostic]:
    camera, radio = scenario.sensors.camera, scenario.radio
    delays = {
        ("sensors", "camera", "delay"): camera.delay,
        ("estimator", "assumed", "camera", "delay"): scenario.estimator.assumed.camera.delay or 0.0,
    }
    for path, delay in delays.items():
        if delay > LONGEST_DELAY:
            yield Diagnostic(path, f"is {delay} s; allowed: at most {LONGEST_DELAY} s")
    if radio.delay + radio.jitter > LONGEST_DELAY:
        yield Diagnostic(
            ("radio",), f"has delay and jitter of {radio.delay + radio.jitter} s; allowed: at most {LONGEST_DELAY} s"
        )


def _durations(scenario: Scenario) -> Iterator[Diagnostic]:
    happen, step = scenario.disturbances, scenario.timing.physics_step
    for name, entries in (
        ("pushes", happen.pushes),
        ("dead_motors", happen.dead_motors),
        ("kidnappings", happen.kidnappings),
    ):
        for k, entry in enumerate(entries):
            if entry.duration is not None and entry.duration < step:
                yield Diagnostic(
                    ("disturbances", name, k, "duration"),
                    f"is {entry.duration} s; allowed: at least timing.physics_step, {step} s",
                )


def _kidnappings(scenario: Scenario) -> Iterator[Diagnostic]:
    """Yield kidnappings that lift a robot which is still in the air."""
    in_time = sorted(enumerate(scenario.disturbances.kidnappings), key=lambda entry: (entry[1].robot, entry[1].time))
    for (_, before), (k, after) in pairwise(in_time):
        down = before.time + before.duration
        if before.robot == after.robot and after.time < down:
            yield Diagnostic(
                ("disturbances", "kidnappings", k, "time"),
                f"is {after.time} s, with robot {after.robot} still in the air; allowed: {down} s or later",
            )
