"""What points and lines make of single scans, and the table of it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from pbrg_mj.perception.points.beams import SeenBeams
from pbrg_mj.perception.points.detect import add_scan
from pbrg_mj.perception.points.memory import no_points
from pbrg_mj.perception.points.parameters import PointParameters, point_parameters
from pbrg_mj.perception.points.past_scan import PAST_ECHO, PAST_POSE
from pbrg_mj.perception.scan.extract_lines import extract_lines
from pbrg_mj.perception.setup import perception_setup
from pbrg_mj.perception.track.world_frame import ScanPose
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.scene.robot import load_robot_model
from scripts.real_scans.carmen import Log
from scripts.real_scans.polylines import RANGE_STD, chains, explained, polylines

VERTICES = (10, 20, 30, 50)
PLE_PLUS = {10: (0.81, 0.078), 20: (0.94, 0.061), 30: (0.97, 0.046), 50: (0.98, 0.018)}  # f and RMSE, published
TOLERANCE = 0.05  # [m] an echo on a line may be so far before it


def scenario_of(log: Log) -> Scenario:
    """A robot with such a scanner."""
    beams = {
        "count": len(log.angles),
        "start_deg": -90.0,
        "sweep_deg": math.degrees(log.angles[-1] - log.angles[0]),
        "range_min": 0.0,
        "range_max": 1000.0,
        "noise_std": RANGE_STD,
    }
    return Scenario.model_validate(
        {
            "team": {"start": [(0, 0)], "formation": [(0, 0)], "leaders": [1]},
            "operator": {"reference": (0, 0)},
            "sensors": {"beams": beams, "camera": {"position_std": 0.0, "heading_std_deg": 0.0}},
            "estimator": {"min_points": 4},
        }
    )


def binding(ranges: np.ndarray, parameters: PointParameters) -> np.ndarray:
    """Whether each echo binds, of one scan (beams,)."""
    points = no_points(1, len(ranges))[0]
    pose = ScanPose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    beams = SeenBeams(ranges, parameters.directions)
    before = np.zeros((1, len(ranges)), PAST_ECHO), np.zeros(1, PAST_POSE)
    add_scan(points, 1, beams, pose, (np.zeros((1, 1, 2)), 0), before, parameters)
    bound = points[(points["live"] == 1) & (points["binds"] == 1)]
    echo = ranges * parameters.directions.T
    places = {(x, y) for x, y in zip(bound["x"].tolist(), bound["y"].tolist(), strict=True)}
    return np.array([(x, y) in places for x, y in echo.T.tolist()])


def behind_lines(ranges: np.ndarray, angles: np.ndarray, log: Scenario) -> np.ndarray:
    """Whether each echo is on or behind a line of the line estimator."""
    setup = perception_setup(log, 0.1)
    lines = extract_lines(ranges, setup.directions, setup.line_params)
    known = np.zeros(len(ranges), dtype=bool)
    for k in range(len(lines)):
        cosine = np.cos(angles - lines.angle[k])
        with np.errstate(divide="ignore", invalid="ignore"):
            r = np.where(cosine > 1e-3, lines.offset[k] / cosine, np.inf)
            s = r * np.sin(angles - lines.angle[k])
        meets = np.isfinite(r) & (s >= lines.low[k] - TOLERANCE) & (s <= lines.high[k] + TOLERANCE)
        known |= meets & (ranges >= r - TOLERANCE)
    return known


def measure(log: Log, scans: int, dear: float) -> Iterator[dict]:
    """Yield the figures of scans taken evenly from a log."""
    scenario = scenario_of(log)
    parameters = point_parameters(scenario, load_robot_model())
    for k in np.linspace(0, len(log.ranges) - 1, scans).astype(int).tolist():
        ranges = log.ranges[k]
        echoes = np.isfinite(ranges)
        if echoes.sum() < 10:
            continue
        bound = binding(ranges, parameters)
        row: dict = {
            "points": float(bound[echoes].mean()),
            "lines": float(behind_lines(ranges, log.angles, scenario)[echoes].mean()),
        }
        runs = chains(ranges, log.angles, bound)
        for vertices in VERTICES:
            error = explained(ranges, log.angles, polylines(ranges, log.angles, runs, vertices, dear))[echoes]
            some = error[np.isfinite(error)]
            row[vertices] = (len(some) / len(error), float(np.sqrt(np.mean(some**2))) if len(some) else math.nan)
        yield row


def table(rows: list[dict]) -> str:
    """The medians over all scans, as a page has them."""
    known = {name: float(np.median([row[name] for row in rows])) for name in ("points", "lines")}
    text = f"{len(rows)} scans; known in one scan: points {known['points']:.3f}, lines {known['lines']:.3f}\n\n"
    text += "| vertices | explained | RMSE [m] | PLE+: explained | RMSE [m] |\n|---|---|---|---|---|\n"
    for vertices in VERTICES:
        f, rmse = (float(np.nanmedian([row[vertices][i] for row in rows])) for i in (0, 1))
        theirs = PLE_PLUS[vertices]
        text += f"| {vertices} | {f:.2f} | {rmse:.3f} | {theirs[0]:.2f} | {theirs[1]:.3f} |\n"
    return text
