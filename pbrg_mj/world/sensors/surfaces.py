"""How obliquely rays meet surfaces, and how much of the light these send back."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeVar

import mujoco
import numpy as np

from pbrg_mj.scenario.schema import WHITE, Column, Prism, Scenario, Wall, World
from pbrg_mj.world.scene.footprints import footprints_of, signed_distance

# In this order MuJoCo writes them: the distance; then, three numbers each, the ray's direction, the place where it
# meets something, which of a white world nobody asks for, and the normal there.
DISTANCE = (mujoco.mjtRayDataField.mjRAYDATA_DIST,)
WITH_NORMAL = (*DISTANCE, mujoco.mjtRayDataField.mjRAYDATA_DIR, mujoco.mjtRayDataField.mjRAYDATA_NORMAL)
WITH_PLACE = (*WITH_NORMAL, mujoco.mjtRayDataField.mjRAYDATA_POINT)
Thing = TypeVar("Thing", Wall, Column, Prism)
ON_SURFACE = 1e-5  # [m] MuJoCo has the corners of prisms in single precision


class Surfaces:
    """What a scenario's rays are asked about the surfaces that they meet: no more than the echoes' power needs."""

    def __init__(self, scenario: Scenario):
        """Look up what is not white."""
        self._reflective = ReflectiveSurfaces(scenario.world)
        self.fields = WITH_PLACE if len(self._reflective.reflectance) else WITH_NORMAL
        if scenario.sensors.beams.signal_range is None:
            self.fields = DISTANCE

    def hit_properties(self, readings: np.ndarray, beams: np.ndarray) -> dict[str, Any]:
        """Return the cosines of incidence and the reflectances, each (b, rays), by their names in an Observation.

        `readings` (values,) are MuJoCo's, `beams` (b, rays) tells where each ray's distance stands in them. A ray that
        meets nothing has the cosine 0.
        """
        if self.fields == DISTANCE:
            return {}
        direction, *place, normal = (
            readings[beams[..., None] + np.arange(3 * k - 2, 3 * k + 1)] for k in range(1, len(self.fields))
        )
        properties = {"cosines": np.abs(np.sum(direction * normal, axis=-1))}
        return {**properties, "reflectances": self._reflective.reflectances(place[0])} if place else properties


class ReflectiveSurfaces:
    """The walls, boxes, columns and prisms of a world that are neither white nor of glass."""

    def __init__(self, world: World):
        """Pick them out."""
        walls, columns, prisms = _not_white(world.obstacles), _not_white(world.columns), _not_white(world.prisms)
        things = [*walls, *columns, *(part for prism in prisms for part in prism.convex())]
        self._footprints = footprints_of(walls, columns, prisms)
        self._height = np.array([one.height for one in things])  # (w,) [m]
        self.reflectance = np.array([one.reflectance for one in things])  # (w,) [-]

    def reflectances(self, places: np.ndarray) -> np.ndarray:
        """Return the reflectances (...,) of the surfaces at `places` (..., 3) [m]; white where none of these is there.

        A thing's surface is where the larger of the distance from its footprint and the height above its top is 0.
        """
        points = places.reshape(-1, 3)
        outside = np.maximum(signed_distance(points[:, :2], self._footprints), points[:, 2:] - self._height)
        off = np.abs(outside)
        nearest = off.argmin(axis=1)
        on_it = off[np.arange(len(points)), nearest] <= ON_SURFACE
        return np.where(on_it, self.reflectance[nearest], WHITE).reshape(places.shape[:-1])


def _not_white(things: Iterable[Thing]) -> list[Thing]:
    return [one for one in things if one.reflectance != WHITE and not one.glass]
