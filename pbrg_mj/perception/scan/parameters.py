"""Parameters of line extraction: the sensor and the estimator."""

from __future__ import annotations

import math
from typing import NamedTuple

from pbrg_mj.scenario.schema import Beams, Scenario, beam_angles

EXACT = 1e-4  # [m] of exact ranges: rounding, and bodies that tilt
NOISE_FLOOR = 1e-3  # [m] below this, straight walls and exact ranges no longer are
NOISE_MARGIN = 3.0  # standard deviations of a range from the least one
FALSE_END = 1e-3  # probability that outliers alone make a gap or an end of a line


class LineParameters(NamedTuple):
    """When points of a scan are one straight line. A named tuple, so that compiled code takes it as it is."""

    range_std: float  # additive noise and quantisation of the ranges, at least NOISE_FLOOR [m]
    noise_ratio: float  # standard deviation of the noise per range [-]
    range_max: float  # [m]
    blind_range: float  # a beam without an echo does not tell of what is nearer [m]
    split_distance: float  # [m]
    min_points: int
    min_length: float  # [m]
    agree: int  # neighbouring beams that must pass by before a line ends or has a gap
    grazing: float  # sine of the flattest angle at which a beam is taken to meet a wall
    least_curve: float  # turn between the segments of one curved surface [rad]
    most_curve: float  # [rad]
    direction_std: float  # a direction less sure than this is none [rad]
    oblique: float  # tangent of the incidence from which on gaps are hidden
    collinear: float  # segments that differ more, noise apart, are never tried as one line [rad]
    least_corner: float  # sine of the angle between two lines that have a corner
    least_gap: float  # along the line that beams must pass [m]
    outlier_density: float = 0.0  # density of outliers over range, against inliers [1/m]
    closed: bool = True  # the beams go all the way round: the last one is next to the first
    half_cone: float = 0.0  # half the width of a beam's view [rad]; 0: a ray
    noise_share: float = 1.0  # of a line's variance that is of the ranges' noise and not of its floor


def line_parameters(scenario: Scenario, clearance: float) -> LineParameters:
    """Return the parameters for a scenario and its robot's clearance [m]; the ideal plant is seen exactly."""
    beams, estimator = scenario.assumed_sensors.beams, scenario.estimator
    given = estimator.thresholds
    exact = scenario.plant == "ideal"
    range_std = 0.0 if exact else math.hypot(beams.noise_std, beams.quantum / math.sqrt(12.0))
    return LineParameters(
        range_std=max(range_std, NOISE_FLOOR),
        noise_ratio=0.0 if exact else beams.noise_ratio,
        range_max=beams.range_max,
        blind_range=blind_range(scenario),
        split_distance=estimator.split_distance,
        min_points=least_points(scenario),
        min_length=estimator.min_length,
        agree=agreeing_beams(0.0 if exact else beams.dropout + beams.outliers),
        outlier_density=0.0 if exact else _outlier_density(beams),
        half_cone=0.0 if exact else 0.5 * math.radians(beams.cone_deg),
        closed=beams.sweep_deg == 360.0,
        noise_share=min(max(range_std, EXACT) / NOISE_FLOOR, 1.0) ** 2 if exact or beams.noise_ratio == 0.0 else 1.0,
        grazing=math.sin(math.radians(given.grazing_deg)),
        least_curve=math.radians(given.curve_least_deg),
        most_curve=math.radians(given.curve_most_deg),
        direction_std=math.radians(given.direction_std_deg),
        oblique=math.tan(math.radians(given.oblique_deg)),
        collinear=math.radians(given.collinear_deg),
        least_corner=math.sin(math.radians(given.corner_deg)),
        least_gap=in_metres(given.least_gap, clearance),
    )


def blind_range(scenario: Scenario) -> float:
    """Return the range [m] from which on things have echoes: by noise some are below `range_min`, and lost."""
    beams = scenario.assumed_sensors.beams
    if scenario.plant == "ideal":
        return beams.range_min
    return beams.range_min + NOISE_MARGIN * math.hypot(beams.noise_std, beams.noise_ratio * beams.range_min)


def least_points(scenario: Scenario) -> int:
    """Return the fewest beams that make a line: more than four robots abreast could give by `min_points` of rays.

    A ray meets one robot. Of cones so many have one in their view as overlap.
    """
    beams, angles = scenario.assumed_sensors.beams, beam_angles(scenario.sensors.beams)
    if scenario.plant == "ideal" or len(angles) < 2:
        return scenario.estimator.min_points
    overlap = max(math.radians(beams.cone_deg) / float(angles[1] - angles[0]), 1.0)
    return 1 + round((scenario.estimator.min_points - 1) * overlap)


def in_metres(clearances: float, clearance: float) -> float:
    """Return a length in clearances of the robot in metres, rounded to 1e-12: 1.5 times 0.1 is 0.15."""
    return round(clearances * clearance, 12)


def _outlier_density(beams: Beams) -> float:
    """Return the density of outliers within the range limits, against one inlier [1/m]."""
    sound = max(1.0 - beams.outliers, FALSE_END)
    return beams.outliers / (sound * (beams.range_max - beams.range_min))


def agreeing_beams(outlier_share: float) -> int:
    """Return how many neighbouring beams, two or more, all are outliers with a probability of at most FALSE_END."""
    if outlier_share <= FALSE_END:
        return 2
    return max(2, math.ceil(math.log(FALSE_END) / math.log(min(outlier_share, 0.5))))
