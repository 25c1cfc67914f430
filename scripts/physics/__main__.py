"""Measure the robot, write docs/physics.md with its figures, print the measurements as JSON.

python scripts/physics          # some five minutes; needs the `plot` extra
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import driving
import motors
import numpy as np
import step_cost
import step_size
from figures import draw
from page import page

DOCS = Path(__file__).resolve().parents[2] / "docs"


def measure() -> dict:
    """Return all measurements by name."""
    return {
        "speed_against_voltage": motors.speed_against_voltage(),
        "breakaway": motors.breakaway(),
        "wheel_creep": motors.wheel_creep(),
        "robot_creep": motors.robot_creep(),
        "breakaway_of_steps": motors.breakaway_of_steps(),
        "coasting": motors.coasting(),
        "tracking": {
            (shape, kind, friction): driving.tracking(shape, kind, friction)
            for shape in driving.SHAPES
            for kind in ("voltage", "speed_loop")
            for friction in (0.0, 1.0)
        },
        "drawn_radius_m": driving.drawn_radius(),
        "deadband": {kind: driving.deadband(kind) for kind in ("voltage", "speed_loop")},
        "slip": driving.slip(),
        "floors": driving.floors(),
        "time_constants_s": step_size.time_constants(),
        "driven_angles_rad": step_size.driven_angles(),
        "closed_loop": step_size.closed_loop(),
        "seeds": step_size.seeds(),
        "reversals_finite": step_size.reversals(),
        "step_cost": step_cost.step_cost(),
    }


def plain(value: Any) -> Any:
    """Return `value` in JSON's types."""
    if isinstance(value, dict):
        return {" ".join(map(str, k)) if isinstance(k, tuple) else k: plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def main() -> int:
    found = measure()
    draw(found, DOCS / "img")
    (DOCS / "physics.md").write_text(page(found), encoding="utf-8")
    json.dump(plain(found), sys.stdout, indent=1)
    print()
    return 0


if __name__ == "__main__":
    sys.exit(main())
