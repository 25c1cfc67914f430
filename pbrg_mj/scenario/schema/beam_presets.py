"""Known range sensors: what `sensors.beams.preset` stands for, each with its source."""

from __future__ import annotations

# A ring of time-of-flight modules of the VL53L1X class: ST's data sheet states millimetre steps, a ranging error of
# 20 mm in the dark (taken as two deviations at 1.5 m), 3.6 m on white and 1.7 m on dark targets, up to 30 Hz over
# the whole range; here half of that. Beams are thin: its 27 degrees of view are those of `tof_cones`.
# Nor are the first 7 cm used, of which it could see 3 more: the robot itself is there.
TOF_RING: dict[str, float | int] = {
    "count": 24,
    "range_max": 3.0,
    "rate_hz": 15.0,
    "noise_std": 0.008,
    "noise_ratio": 0.005,
    "quantum": 0.001,
    "dropout": 0.02,
    "outliers": 0.005,
}

PRESETS: dict[str, dict[str, float | int]] = {
    "ideal": {"noise_std": 0.0},
    # The Robotarium simulator's range model: 3 % multiplicative noise, 3.5 % dropout, 1.4 % outliers.
    "robotarium": {"noise_std": 0.0, "noise_ratio": 0.03, "dropout": 0.035, "outliers": 0.014},
    "tof_ring": TOF_RING,
    # A small scanning lidar of the RPLIDAR A1 class: Slamtec's data sheet states 0.15 to 12 m on white targets (8 m
    # here), 360 samples a turn at 5.5 to 10 turns a second, better than 0.5 mm below 1.5 m and 1 % beyond (taken as
    # two deviations); its protocol counts quarters of a millimetre. The whole turn is seen in one instant here.
    "lidar": {
        "count": 360,
        "range_min": 0.15,
        "range_max": 8.0,
        "rate_hz": 8.0,
        "noise_std": 0.003,
        "noise_ratio": 0.005,
        "quantum": 0.00025,
        "dropout": 0.01,
        "outliers": 0.001,
    },
    # The same modules with the view of the data sheet: the nearest thing within 27 degrees, and echoes that are lost as
    # the power that comes back falls: 3.6 m on white, of which 1.7 m on dark targets follow (0.17 of the light, not
    # 0.88: 3.6 m x sqrt(0.17 / 0.88) = 1.6 m).
    "tof_cones": {**TOF_RING, "cone_deg": 27.0, "signal_range": 3.6},
    # The TurtleBot3's LDS-02, by ROBOTIS' e-manual: 0.16 to 8 m, 1 degree, 5 turns a second, +-10 mm below 0.3 m and
    # +-3 % to 6 m (taken as two deviations). It turns while the robot moves.
    "lds_02": {
        "count": 360,
        "range_min": 0.16,
        "range_max": 8.0,
        "rate_hz": 5.0,
        "scan_time": 0.2,
        "noise_std": 0.005,
        "noise_ratio": 0.015,
        "quantum": 0.001,
        "dropout": 0.01,
        "outliers": 0.001,
    },
}
"""What a preset sets. Keys given beside it win."""
