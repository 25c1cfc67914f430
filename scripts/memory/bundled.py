"""Bundled scenarios that call the kernels of all stages between them.

Physics and the ideal plant, walls, corners, robots and things that move before beams at both heights, points of
whatever echoes, delay, loss and waves, all governors and certificates, worlds side by side.
"""

from __future__ import annotations

BEYOND = [{"robot": 5, "normal": [1, 1], "offset": 0.5}, {"robot": 4, "normal": [-1, -1], "offset": 0.5}]
RUNS = {  # name of the log: scenario, overrides
    "near": ("paper/experiment_near", {"timing.duration": 2.0}),
    "inadmissible": ("paper/experiment_inadmissible", {"timing.duration": 2.0}),
    "corner": ("obstacles/corner", {"timing.duration": 2.0}),
    "moving_box": ("obstacles/moving_box", {"timing.duration": 1.0}),
    "low_beams": ("sensing/low_beams", {"timing.duration": 1.0}),
    "robotarium": ("sensing/robotarium_sensor", {"timing.duration": 1.0}),
    "guarded": ("sensing/late_detection_guarded", {"timing.duration": 1.0}),
    "carried_away": ("disturbances/carried_away", {"timing.duration": 1.0}),
    "certified": ("sensing/late_detection", {"timing.duration": 1.0, "governor.kind": "certified"}),
    "lossy": ("network/lossy", {"timing.duration": 1.0}),
    "waves": ("network/delayed_scattering", {"timing.duration": 1.0}),
    "speed_limited": ("team/speed_limited", {"timing.duration": 1.0}),
    "centralized": ("paper/simulation_near", {"timing.duration": 0.5, "governor.kind": "centralized"}),
    "points": ("families/clutter", {"timing.duration": 1.0, "set_up": "recommended"}),
    "known_free": (
        "families/combined",
        {"timing.duration": 1.0, "set_up": "recommended", "estimator.unknown": "closed", "seed": 3},
    ),
    "blind_sides": (
        "families/columns",
        {
            "timing.duration": 1.0,
            "set_up": "recommended",
            "estimator.unknown": "strict",
            "sensors.beams.preset": "tof_cones",
            "sensors.odometry.fuse": True,
            "drive.pwm_levels": 255,
        },
    ),
    "rollout": ("obstacles/corner", {"timing.duration": 1.0, "governor.kind": "rollout"}),
    "directional_flow": ("obstacles/corridor", {"timing.duration": 1.0, "governor.certificate": "directional_ball"}),
    "layer": (
        "paper/simulation_inadmissible",
        {
            "timing.duration": 0.5,
            "governor.kind": "certified",
            "governor.optimizer": "paper_flow",
            "governor.certificate": "directional_ball",
        },
    ),
    "beyond_the_line": (
        "paper/simulation_inadmissible",
        {"timing.duration": 0.5, "governor.kind": "certified", "estimator.given": BEYOND},
    ),
    "barrier": ("obstacles/corner", {"timing.duration": 0.5, "governor.kind": "cbf"}),
    "potential_field": ("obstacles/corner", {"timing.duration": 0.5, "governor.kind": "potential_field"}),
}
BATCH = ("paper/experiment_near", {"timing.duration": 1.0, "sensors.beams.robots": "all"}, range(1, 4))
