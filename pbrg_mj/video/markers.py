"""Marks that are added to a scene: lines as wide as pixels, and flat shapes on the floor."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco
import numpy as np

Colour = tuple[float, float, float, float] | np.ndarray

_LINE, _BOX, _DISC = mujoco.mjtGeom.mjGEOM_LINE, mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER
FLAT = 1e-4  # half the thickness of marks [m]
_NOTHING = np.zeros(3)
_UPRIGHT = np.eye(3).ravel()


class Markers:
    """Adds geoms to a scene up to its largest number; what does not fit is left out."""

    def __init__(self, scene: mujoco.MjvScene, pixel: float):
        """`pixel` is the width of the thinnest line [pixels]."""
        self._scene, self._pixel = scene, pixel
        self._geoms = scene.geoms

    def line(self, start: np.ndarray, end: np.ndarray, width: float, colour: Colour) -> None:
        """Draw a straight line between points (3,) [m], `width` times the thinnest."""
        geom = self._next()
        if geom is not None:
            mujoco.mjv_initGeom(geom, _LINE, _NOTHING, _NOTHING, _UPRIGHT, np.asarray(colour, dtype=np.float32))
            mujoco.mjv_connector(geom, _LINE, width * self._pixel, start, end)

    def disc(self, centre: np.ndarray, radius: float, colour: Colour) -> None:
        """Draw a disc at `centre` (3,) [m]."""
        self._flat(_DISC, np.array([radius, FLAT, 0.0]), centre, 0.0, colour)

    def bar(self, centre: np.ndarray, half_size: tuple[float, float], angle: float, colour: Colour) -> None:
        """Draw a rectangle at `centre` (3,) [m] whose first side points at `angle` [rad]."""
        self._flat(_BOX, np.array([*half_size, FLAT]), centre, angle, colour)

    def dot(self, centre: np.ndarray, half_size: float, colour: Colour) -> None:
        """Draw a small cube: the cheapest shape that is seen from everywhere."""
        geom = self._next()
        if geom is not None:
            size = np.full(3, half_size)
            mujoco.mjv_initGeom(geom, _BOX, size, centre, _UPRIGHT, np.asarray(colour, dtype=np.float32))

    def star(self, centre: np.ndarray, radius: float, angles: np.ndarray, colour: Colour) -> None:
        """Draw crossing bars at `angles` [rad]: two make a cross, three a star."""
        for angle in angles.tolist():
            self.bar(centre, (radius, 0.2 * radius), angle, colour)

    def _flat(self, kind: int, size: np.ndarray, centre: np.ndarray, angle: float, colour: Colour) -> None:
        geom = self._next()
        if geom is not None:
            c, s = np.cos(angle), np.sin(angle)
            turn = np.array([c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0])
            mujoco.mjv_initGeom(geom, kind, size, centre, turn, np.asarray(colour, dtype=np.float32))
            geom.emission, geom.specular = 0.3, 0.0  # marks are no things: light hardly touches them

    def _next(self) -> mujoco.MjvGeom | None:
        scene = self._scene
        if scene.ngeom >= scene.maxgeom:
            return None
        geom = self._geoms[scene.ngeom]
        scene.ngeom += 1
        geom.category = mujoco.mjtCatBit.mjCAT_DECOR
        return geom
