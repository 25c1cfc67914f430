"""A camera whose projection is known: the same numbers place MuJoCo's camera and tell where a point is seen."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np


@dataclass(frozen=True)
class Camera:
    """Where it stands and what it sees; `forward` and `up` are unit vectors at a right angle."""

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
        """Make the scene be seen from here."""
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


def looking(eye: np.ndarray, target: np.ndarray, half_height: float, far: float, mark: float) -> Camera:
    """Return the upright perspective camera at `eye` (3,) that looks at `target` (3,) [m]."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return Camera(eye, forward, np.cross(right, forward), half_height, False, 0.02, far, mark)


def from_above(centre: np.ndarray, half_height: float, mark: float) -> Camera:
    """Return the orthographic camera above `centre` (2,) [m], with +y up in the picture."""
    eye, down, up = np.array([*centre, 10.0]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0])
    return Camera(eye, down, up, half_height, True, 0.5, 100.0, mark)
