"""What cameras frame: the area of a run that matters, beside a column of the picture that is left to words."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pbrg_mj.analysis.metrics.area_of_interest import CORNERS, points_of_interest
from pbrg_mj.log.read.run import Run
from pbrg_mj.video.playback import held, smoothed
from pbrg_mj.video.settings import RenderTask

FARTHEST = 30.0  # from the team's start, what is farther is not followed [m]: a run may diverge
BORDER = 0.25  # around what is framed [m]
LEAST = 1.2  # side of what is framed [m]
LOOK = 3.0  # from the team, robots and r, how far a camera that follows it looks for what else matters [m]
HIGHEST = 0.5  # of things whose upper edges are framed [m]
SMOOTHING = 4.0  # [s]
FULL_HEIGHT = 720  # of a picture whose thinnest line is a pixel wide [pixels]
FONT_STEP, SMALLEST_FONT, LARGEST_FONT = 50, 100, 300  # the sizes that MuJoCo has [%]
LETTER = 8.3  # width of a letter, on the average, in its smallest font [pixels]
NAMES, SHORTEST = 12, 18  # letters of the caption's left column and margins, and of its right one at least
WIDEST = 0.4  # of the picture's width, the column of words
RIM = 0.02  # of the picture's height, left free all round


class Viewport(NamedTuple):
    """The part of a picture that things are framed in [pixels], right and down from the upper left corner."""

    left: float
    top: float
    right: float
    bottom: float


def font_scale(height: int) -> int:
    """Return the font's size [%] in a picture so many pixels high."""
    wanted = FONT_STEP * round(100 * height / FULL_HEIGHT / FONT_STEP)
    return int(np.clip(wanted, SMALLEST_FONT, LARGEST_FONT))


def viewport(task: RenderTask) -> Viewport:
    """Return what the words leave of the picture: all but a column at the left; all of it where there is no column."""
    (width, height), rim = task.size, RIM * task.size[1]
    column = _column(task) if "text" in task.layers else 0.0
    return Viewport(column + rim, rim, width - rim, height - rim)


def _column(task: RenderTask) -> float:
    """Return the width [pixels] of the words, of all but a long name if that is too wide; 0 in small pictures."""
    longest = max(map(len, [task.run.name, *np.unique(task.run.ticks.status).tolist()]))
    widths = [(NAMES + letters) * LETTER * font_scale(task.size[1]) / 100 for letters in (SHORTEST, longest)]
    return max((width for width in widths if width <= WIDEST * task.size[0]), default=0.0)


def framed_points(run: Run) -> np.ndarray:
    """Return the points (k, 2) [m] that enclose what is framed of the whole run."""
    goals = run.ticks.reference[-1] + np.array(run.scenario.team.formation)
    shown = points_of_interest(run, np.vstack([run.ticks.m.reshape(-1, 2), run.ticks.reference, goals]))
    middle = (shown.min(axis=0) + shown.max(axis=0)) / 2
    return np.vstack([*(shown + BORDER * corner for corner in CORNERS), middle + LEAST / 2 * CORNERS])


def follow_bounds(run: Run) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners (T, 2), (T, 2) [m] of what a camera that follows the team looks at: LOOK past it and r."""
    ticks, start = run.ticks, np.mean(run.scenario.team.start, axis=0)
    points = held(np.concatenate([ticks.hand_true, ticks.m, ticks.reference[:, None]], axis=1))
    points = np.clip(points, start - FARTHEST, start + FARTHEST)
    window = round(SMOOTHING / run.scenario.timing.tick)
    return smoothed(points.min(axis=1) - LOOK, window), smoothed(points.max(axis=1) + LOOK, window)


def with_heights(run: Run, points: np.ndarray) -> np.ndarray:
    """Return points (k, 2) [m] on the floor and at the height of the highest thing's upper edge, (2 k, 3)."""
    world = run.scenario.world
    things = (*world.walls, *world.boxes, *world.columns, *world.prisms, *world.moving_boxes)
    height = min(max((thing.height for thing in things), default=0.0), HIGHEST)
    return np.vstack([np.column_stack([points, np.full(len(points), z)]) for z in (0.0, height)])


def nearest_eye(
    points: np.ndarray, axes: np.ndarray, half_height: float, size: tuple[int, int], free: Viewport
) -> np.ndarray:
    """Return the eye (3,) nearest to points (k, 3) [m] that sees them all in the free part of a perspective picture.

    `axes` (3, 3) are the camera's unit vectors right, up, forward; `half_height` is the picture's at a distance of 1.
    """
    slope = half_height / (size[1] / 2)  # of a pixel
    sides = np.array(
        [[size[0] / 2 - free.left, free.right - size[0] / 2], [free.bottom - size[1] / 2, size[1] / 2 - free.top]]
    )
    back, ahead = slope * sides.T
    across, depth = (points @ axes[:2].T), points @ axes[2]
    least = (across - ahead * depth[:, None]).max(axis=0)
    most = (across + back * depth[:, None]).min(axis=0)
    distance = np.min((most - least) / (back + ahead))
    eye = (least + ahead * distance + most - back * distance) / 2
    return eye @ axes[:2] + distance * axes[2]


def top_view(points: np.ndarray, size: tuple[int, int], free: Viewport) -> tuple[np.ndarray, float]:
    """Return the point (2,) [m] under the middle of a picture from above of points (k, 2), and half its height [m]."""
    low, high = points.min(axis=0), points.max(axis=0)
    sides = np.array([free.right - free.left, free.bottom - free.top])
    pixel = float(np.max((high - low) / sides))  # [m]
    off = np.array([(free.left + free.right - size[0]) / 2, (size[1] - free.top - free.bottom) / 2])
    return (low + high) / 2 - pixel * off, pixel * size[1] / 2
