"""Conditions that most worlds lack: sensing that is worse, robots that differ, other floors; each world has one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from other_worlds.solids import number, numbers


class Drawn(NamedTuple):
    """A world to which a condition is added."""

    rng: np.random.Generator
    scenario: dict[str, Any]

    @property
    def count(self) -> int:
        return len(self.scenario["team"]["start"])

    @property
    def beams(self) -> dict[str, Any]:
        return self.scenario["sensors"]["beams"]

    @property
    def camera(self) -> dict[str, Any]:
        return self.scenario["sensors"].setdefault("camera", {})

    def uniform(self, low: float, high: float) -> float:
        return number(self.rng.uniform(low, high))

    def of_each(self, low: float, high: float) -> list[float]:
        """Return a number for each robot."""
        return numbers(self.rng.uniform(low, high, self.count))


def odometry(world: Drawn) -> None:
    """Fuse encoders with a camera of 3 to 30 Hz that loses up to 30 % of its frames."""
    world.scenario["sensors"]["odometry"] = {"fuse": True}
    world.camera.update(rate_hz=world.uniform(3.0, 30.0), lost_frames=world.uniform(0.0, 0.3))


def occlusions(world: Drawn) -> None:
    """Hide robots from the camera four times, for 0.2 to 2 s; encoders are fused, or nothing is."""
    hidden = [(int(world.rng.integers(1, world.count + 1)), world.uniform(0.5, 20.0)) for _ in range(4)]
    world.camera["occlusions"] = [
        {"robot": robot, "time": time, "duration": world.uniform(0.2, 2.0)} for robot, time in hidden
    ]
    world.scenario["sensors"]["odometry"] = {"fuse": bool(world.rng.random() < 0.7)}


def swapped_identities(world: Drawn) -> None:
    """Let the camera take two robots for each other three times, for 0.1 to 1 s."""
    pairs = [sorted((world.rng.choice(world.count, 2, replace=False) + 1).tolist()) for _ in range(3)]
    times = zip(pairs, (2.0, 10.0, 18.0), strict=True)
    world.camera["swaps"] = [
        {"robots": pair, "time": time, "duration": world.uniform(0.1, 1.0)} for pair, time in times
    ]


def radio_ranges(world: Drawn) -> None:
    """Find x and y from radio ranges of 0.5 to 3 cm, a few of them late, with encoders."""
    anchors, std = [[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]], world.uniform(0.005, 0.03)
    late = {"late_share": 0.05, "late_mean": 0.05}
    world.scenario["sensors"] |= {"uwb": {"anchors": anchors, "range_std": std, **late}, "odometry": {"fuse": True}}


def camera_bias(world: Drawn) -> None:
    """See robots up to 1 cm beside where they are, along each axis, and turned by up to 1 degree."""
    bias = {"bias_x": world.of_each(-0.01, 0.01), "bias_y": world.of_each(-0.01, 0.01)}
    world.camera.update(**bias, heading_bias_deg=world.of_each(-1.0, 1.0))


def worse_beams(world: Drawn) -> None:
    """Lose up to 20 % of the echoes, up to 3 % anywhere, noise up to 2 cm, ranges in steps of up to 2 cm."""
    dropout, outliers = world.uniform(0.0, 0.2), world.uniform(0.0, 0.03)
    noise, quantum = world.uniform(0.002, 0.02), world.uniform(0.001, 0.02)
    world.beams.update(dropout=dropout, outliers=outliers, noise_std=noise, quantum=quantum)


def sector(world: Drawn) -> None:
    """Let beams see 120 to 300 degrees ahead."""
    sweep = world.uniform(120.0, 300.0)
    world.beams.update(sweep_deg=sweep, start_deg=number(-sweep / 2))


def other_rate(world: Drawn) -> None:
    """Have another number of beams, 16 to 180, and 4 to 8 scans a second."""
    world.beams.update(rate_hz=world.uniform(4.0, 8.0), count=int(world.rng.choice([16, 24, 36, 48, 120, 180])))
    if world.beams["preset"] == "lds_02":  # which turns once a scan
        world.beams["scan_time"] = 0.12


def slow_scan(world: Drawn) -> None:
    """Take 30 to 100 ms for a scan, ten times a second."""
    world.beams.update(rate_hz=10.0, scan_time=world.uniform(0.03, 0.1))


def dark_surfaces(world: Drawn) -> None:
    """Lose echoes for want of light beyond 2 to 6 m from white; half of what stands is darker, down to 5 %."""
    world.beams["signal_range"] = world.uniform(2.0, 6.0)
    for kind in ("walls", "boxes", "columns", "prisms"):
        for solid in world.scenario["world"].get(kind, []):
            if world.rng.random() < 0.5:
                solid["reflectance"] = world.uniform(0.05, 0.9)


def wrong_assumptions(world: Drawn) -> None:
    """Assume other noise of beams and camera than theirs."""
    camera = {"position_std": world.uniform(0.0005, 0.003), "heading_std_deg": world.uniform(0.1, 0.6)}
    beams = {"noise_std": world.uniform(0.001, 0.01)}
    world.scenario["estimator"] = {"assumed": {"beams": beams, "camera": camera}}


def unlike_robots(world: Drawn) -> None:
    """Let robots differ: mass by 15 %, motors by 10 %, wheels by 3 %, friction by 30 %."""
    most = {"mass": 0.15, "motor_constant": 0.1, "wheel_radius": 0.03, "friction": 0.3}
    world.scenario["team"]["variation"] = {key: world.of_each(1.0 - one, 1.0 + one) for key, one in most.items()}


def patches(world: Drawn) -> None:
    """Lay three patches of 0.3 to 2 m, with less friction or more rolling resistance than the floor."""
    corners = world.rng.uniform(-2.0, 1.0, (3, 2))
    world.scenario["world"]["patches"] = [
        {
            "from": numbers(one),
            "to": numbers(one + world.rng.uniform(0.3, 2.0, 2)),
            "friction": world.uniform(0.4, 1.0),
            "rolling_resistance": world.uniform(0.0, 0.03),
        }
        for one in corners
    ]


def rolling_resistance(world: Drawn) -> None:
    """Resist rolling by 0.5 to 4 % of the weight."""
    world.scenario["world"]["rolling_resistance"] = world.uniform(0.005, 0.04)


def slow_ticks(world: Drawn) -> None:
    """Govern and control every 20 or 50 ms."""
    world.scenario["timing"]["tick"] = float(world.rng.choice([0.02, 0.05]))


Condition = Callable[[Drawn], None]
CONDITIONS: dict[str, Condition] = {
    "an EKF of encoders and a slow camera": odometry,
    "robots hidden from the camera": occlusions,
    "identities swapped by the camera": swapped_identities,
    "radio ranges and encoders": radio_ranges,
    "a biased camera": camera_bias,
    "worse beams": worse_beams,
    "beams in a sector": sector,
    "other beams and scans": other_rate,
    "scans that take time": slow_scan,
    "dark surfaces": dark_surfaces,
    "wrong assumptions": wrong_assumptions,
    "robots that differ": unlike_robots,
    "patches of floor": patches,
    "rolling resistance": rolling_resistance,
    "slow ticks": slow_ticks,
}
ON_WHEELS = {odometry, occlusions, radio_ranges, unlike_robots, patches, rolling_resistance}


def condition_of(seed: int) -> str:
    """Return the name of the condition in the world of a seed."""
    return list(CONDITIONS)[seed % len(CONDITIONS)]
