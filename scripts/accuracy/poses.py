"""Convex rooms as in rooms.py, with poses that are not a fast camera's: how right a robot is about its walls then.

python scripts/accuracy/poses.py [--seeds 50]    # the table of docs/perception-accuracy.md

Wheels slip as the filter assumes: the variance of a wheel's travel is `sensors.odometry.slip` per metre.
"""

from __future__ import annotations

import argparse

import numpy as np
from rooms import ROOMS, SCANS, Drive, way
from scanning_robot import scenario
from walls import band

from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.plant.interface import Observation

CORNERS = ((-3.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-3.0, 3.0))  # where radio anchors stand [m]
SLOW = {"rate_hz": 2.0, "delay": 0.2}
COARSE = {"rate_hz": 10.0, "position_std": 0.01, "heading_std_deg": 2.0}
POSES: dict[str, dict] = {
    "camera, 30 Hz": {},
    "camera, 2 Hz, 0.2 s late": {"camera": SLOW},
    "filter, camera 30 Hz": {"odometry": {"fuse": True}},
    "filter, camera 10 Hz": {"odometry": {"fuse": True}, "camera": {"rate_hz": 10.0}},
    "filter, camera 10 Hz, 1 cm, 2 deg": {"odometry": {"fuse": True}, "camera": COARSE},
    "filter, camera 2 Hz, 0.2 s late": {"odometry": {"fuse": True}, "camera": SLOW},
    "radio, all in line of sight": {"uwb": {"anchors": CORNERS, "late_share": 0.0}},
    "radio, one range in ten late": {"uwb": {"anchors": CORNERS}},
}


class DriveOnWheels(Drive):
    """A drive that tells the angles of its wheels, which slip."""

    wheels = np.zeros(2)  # angles [rad]
    turned = 0.0  # [s] until when

    def observed(self, frame: int, scan: int, time: float) -> Observation:
        """What the sensors hold at a time [s]: a frame of the camera, a scan and the wheels."""
        filtering = self.noise.pose_filter
        if time > self.turned and filtering is not None:
            turn = 0.5 * filtering.track * self.turn
            travel = np.array([self.speed - turn, self.speed + turn]) * (time - self.turned)
            random = np.random.default_rng([self.noise.seed, 99, round(1e6 * time)])
            slipped = travel + np.sqrt(filtering.slip * np.abs(travel)) * random.standard_normal(2)
            self.wheels, self.turned = self.wheels + slipped / filtering.wheel_radius, time
        return super().observed(frame, scan, time)._replace(wheel_angle=self.wheels[None])


def squares(sensors: dict, seed: int) -> list[float]:
    """Normalised errors squared (len(SCANS),) of one wall of a room after so many scans; NaN for none."""
    given = Scenario.model_validate(scenario("generic", seed).model_dump(by_alias=True) | {"sensors": sensors})
    random = np.random.default_rng([seed, 5])
    corners = ROOMS["convex_room"](random)
    robot = DriveOnWheels(given, corners, *way(random, corners, SCANS[-1] / given.sensors.beams.rate_hz))
    row = [np.nan] * len(SCANS)
    for k in range(1, SCANS[-1] + 1):
        robot.scan()
        if k in SCANS and (found := robot.errors()):
            row[SCANS.index(k)] = found[int(random.integers(len(found)))][2]
    return row


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=50)
    args = parser.parse_args()
    low, high = band(args.seeds)
    after = " | ".join(f"NEES after {scans} scans | median" for scans in SCANS)
    print(f"| poses | {after} |\n|{'---|' * (2 * len(SCANS) + 1)}")
    for name, sensors in POSES.items():
        found = np.array([squares(sensors, seed) for seed in range(args.seeds)])
        pairs = zip(np.nanmean(found, axis=0), np.nanmedian(found, axis=0), strict=True)
        print(f"| {name} | {' | '.join(f'{mean:.1f} | {median:.1f}' for mean, median in pairs)} |", flush=True)
    print(f"\nThe mean of {args.seeds} honest ones is from {low:.2f} to {high:.2f}.")


if __name__ == "__main__":
    main()
