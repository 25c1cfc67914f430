"""Cameras with a known projection, and the path of each named camera over a run."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from pbrg_mj.video.framing import follow_bounds, framed_points, nearest_eye, top_view, viewport, with_heights
from pbrg_mj.video.playback import Motion, between, held, smoothed
from pbrg_mj.video.settings import ROBOT_CAMERA, RenderTask

ROBOT_SMOOTHING = 0.8  # [s]
CHASE_MARK = 0.008  # size of marks, at a distance of 1
CHASE_ELEVATION = np.deg2rad(42.0)
CHASE_HALF_HEIGHT, ROBOT_HALF_HEIGHT = np.tan(np.deg2rad(20.0)), np.tan(np.deg2rad(30.0))
BEHIND, ABOVE, AHEAD = 0.55, 0.34, 0.6  # the robot camera's eye and target from the body [m]


@dataclass(frozen=True)
class Camera:
    """A camera's place and field of view; `forward` and `up` are unit vectors at a right angle."""

    eye: np.ndarray  # (3,) [m]
    forward: np.ndarray  # (3,)
    up: np.ndarray  # (3,)
    half_height: float  # of the picture: [m] if orthographic, else at a distance of 1 [-]
    orthographic: bool
    near: float  # [m]
    far: float  # [m]
    mark: float  # size of marks that are seen well from here [m]

    def project(self, points: np.ndarray, size: tuple[int, int]) -> np.ndarray:
        """Return the pixels (k, 2), right and down from the upper left corner, of points (k, 3) [m] in front."""
        width, height = size
        offset = points - self.eye
        depth = np.ones(len(points)) if self.orthographic else offset @ self.forward
        right = offset @ np.cross(self.forward, self.up) / depth
        upward = offset @ self.up / depth
        scale = height / 2 / self.half_height
        return np.column_stack([width / 2 + scale * right, height / 2 - scale * upward])

    def place(self, scene: mujoco.MjvScene, size: tuple[int, int]) -> None:
        """Let the scene be drawn from here."""
        top = self.half_height * (1.0 if self.orthographic else self.near)
        for view in scene.camera:
            view.pos, view.forward, view.up = self.eye, self.forward, self.up
            view.frustum_bottom, view.frustum_top = -top, top
            view.frustum_width, view.frustum_center = top * size[0] / size[1], 0.0
            view.frustum_near, view.frustum_far = self.near, self.far
            view.orthographic = int(self.orthographic)
        for light in scene.lights[: scene.nlight]:
            if light.headlight:
                light.pos, light.dir = self.eye, self.forward


def perspective_camera(eye: np.ndarray, target: np.ndarray, half_height: float, far: float, mark: float) -> Camera:
    """Return the upright perspective camera at `eye` (3,) that looks at `target` (3,) [m]."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return Camera(eye, forward, np.cross(right, forward), half_height, False, 0.02, far, mark)


def top_camera(centre: np.ndarray, half_height: float, mark: float) -> Camera:
    """Return the orthographic camera above `centre` (2,) [m], with +y up in the picture."""
    eye, down, up = np.array([*centre, 10.0]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0])
    return Camera(eye, down, up, half_height, True, 0.5, 100.0, mark)


CameraPath = Callable[[float], Camera]


def camera_path(task: RenderTask, motion: Motion) -> CameraPath:
    """Return the camera over time that the task names."""
    if task.camera.startswith(ROBOT_CAMERA):
        return _robot(motion, int(task.camera.removeprefix(ROBOT_CAMERA)) - 1)
    if task.camera == "top":
        camera = _top(task)
        return lambda _time: camera
    return _chase(task)


def _top(task: RenderTask) -> Camera:
    centre, half = top_view(framed_points(task.run), task.size, viewport(task))
    return top_camera(centre, half, mark=0.02 * half)


def _chase(task: RenderTask) -> CameraPath:
    """From behind the team as it starts off, at a steady bearing, as near as all that is framed allows."""
    run, free = task.run, viewport(task)
    points, time, (low, high) = framed_points(run), run.ticks.time, follow_bounds(run)
    direction = run.ticks.reference[-1] - held(run.ticks.m)[0].mean(axis=0)
    direction = direction / np.linalg.norm(direction) if np.linalg.norm(direction) > 0.1 else np.array([0.0, 1.0])
    forward = np.array([*(np.cos(CHASE_ELEVATION) * direction), -np.sin(CHASE_ELEVATION)])
    right = np.array([direction[1], -direction[0], 0.0])
    axes = np.array([right, np.cross(right, forward), forward])

    def at(now: float) -> Camera:
        framed = with_heights(run, np.clip(points, between(time, low, now), between(time, high, now)))
        eye = nearest_eye(framed, axes, CHASE_HALF_HEIGHT, task.size, free)
        distance = float((framed.mean(axis=0) - eye) @ forward)
        return perspective_camera(eye, eye + forward, CHASE_HALF_HEIGHT, 30 * distance, mark=CHASE_MARK * distance)

    return at


def _robot(motion: Motion, robot: int) -> CameraPath:
    """Over the robot's shoulder."""
    step = float(np.median(np.diff(motion.time))) if len(motion.time) > 1 else 1.0
    pose = motion.pose[:, robot].copy()
    pose[:, 2] = smoothed(pose[:, 2], round(ROBOT_SMOOTHING / step))

    def at(time: float) -> Camera:
        x, y, heading = between(motion.time, pose, time)
        body, ahead = np.array([x, y, 0.0]), np.array([np.cos(heading), np.sin(heading), 0.0])
        eye = body - BEHIND * ahead + [0.0, 0.0, ABOVE]
        return perspective_camera(eye, body + AHEAD * ahead, ROBOT_HALF_HEIGHT, 60.0, mark=0.025)

    return at
