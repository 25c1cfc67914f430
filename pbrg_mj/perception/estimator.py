"""What turns readings into half-spaces: our own pipeline, or a plug-in's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from pbrg_mj import plugins
from pbrg_mj.errors import PlugInError
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.perception.perceive import PerceptionMemory, initial, perceive
from pbrg_mj.perception.points.estimator import PointEstimator
from pbrg_mj.perception.points.parameters import point_parameters
from pbrg_mj.perception.setup import PerceptionSetup, perception_setup
from pbrg_mj.plugin_calls import copied, plug_in_errors, read_only_copy, where_active, within
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.sensing.readings import Readings
from pbrg_mj.world.scene.robot import RobotModel

UNIT = 1e-9  # how far the length of a normal may be from 1
FARTHEST = 1e9  # [m] of an h


class Estimator(Protocol):
    """Frozen parameters; all that changes is the memory that goes in and comes out."""

    def init(self) -> Any:
        """Return the memory before the first tick."""
        ...

    def step(self, readings: Readings, time: float, memory: Any) -> tuple[HalfSpaces, Any]:
        """Return the half-spaces every robot knows at `time` [s], the same object while they do not change."""
        ...


@runtime_checkable
class GoalDirectedEstimator(Estimator, Protocol):
    """One whose half-spaces depend on where robots are going."""

    def step_towards(
        self, readings: Readings, time: float, memory: Any, m: np.ndarray | None
    ) -> tuple[HalfSpaces, Any]:
        """Do what `step` does; robots hold the governed references m (n, 2) [m], None before the first tick."""
        ...


@dataclass(frozen=True)
class LineEstimator:
    """Scans to lines to tracks to half-spaces, or the half-spaces given."""

    setup: PerceptionSetup

    def init(self) -> PerceptionMemory:
        """Return the given half-spaces, or none."""
        return initial(self.setup)

    def step(self, readings: Readings, time: float, memory: PerceptionMemory) -> tuple[HalfSpaces, PerceptionMemory]:
        """Do what `perceive` does."""
        return perceive(readings, time, memory, self.setup)


def estimator(scenario: Scenario, robot: RobotModel, given: Any = None) -> Estimator:
    """Return the scenario's estimator: ours, one of an installed package, or the object `given`.

    Raises InputError for an unknown name and wrong options, PlugInError when a plug-in cannot be built.
    """
    if given is None and scenario.estimator.source == "points":
        return PointEstimator(
            parameters=point_parameters(scenario, robot),
            robots=np.array(scenario.beam_robots, dtype=np.int64),
            formation=np.array(scenario.team.formation, dtype=float),
            slots=scenario.estimator.half_spaces_per_robot,
        )
    if given is None and scenario.estimator.source in plugins.ESTIMATOR.built_in:
        return LineEstimator(perception_setup(scenario, robot.clearance, robot.hand_offset, robot.body_radius))
    name, built = plugins.build(plugins.ESTIMATOR, scenario, given, robot=robot)
    slots, limit = scenario.estimator.half_spaces_per_robot, scenario.timing.plug_in_limit
    return PlugInEstimator(built, name, scenario.robots, slots, limit)


@dataclass(frozen=True)
class PlugInEstimator:
    """An estimator of another package, whose half-spaces are checked, and copied when they are others than before."""

    inner: Estimator
    name: str
    robots: int
    slots: int
    limit: float | None = None  # of a call [s]

    def init(self) -> tuple[Any, HalfSpaces | None]:
        """Return its memory; with it goes our copy of what it answered last."""
        with plug_in_errors("estimator", self.name, "init", self.limit):
            return self.inner.init(), None

    def step(self, readings: Readings, time: float, memory: Any) -> tuple[HalfSpaces, Any]:
        """Return a copy of its half-spaces. Raises PlugInError when it fails, for other shapes and normals."""
        (own, last), given = memory, read_only_copy(readings)
        with plug_in_errors("estimator", self.name, "step", self.limit):
            answer = self.inner.step(given, time, own)
        if not (isinstance(answer, tuple) and len(answer) == 2):
            returned = type(answer).__name__
            raise PlugInError(f"{self.name}: the estimator's step returned {returned}, not half-spaces and memory")
        found = self._checked(answer[0])
        return (last, (answer[1], last)) if last is not None and _equal(found, last) else (found, (answer[1], found))

    def _checked(self, found: HalfSpaces) -> HalfSpaces:
        whose, shape = f"{self.name}: the estimator", (self.robots, self.slots)
        if not isinstance(found, HalfSpaces):
            raise PlugInError(f"{whose}'s step returned {type(found).__name__} and memory, not HalfSpaces and memory")
        active = copied(whose, "active", found.active, shape, bool)
        checked = HalfSpaces(
            G=where_active(active, copied(whose, "G", found.G, (*shape, 2))),
            h=where_active(active, copied(whose, "h", found.h, shape)),
            active=active,
            binds=copied(whose, "binds", found.binds, (*shape, self.robots), bool),
        )
        lengths = np.linalg.norm(checked.G[checked.active], axis=1)
        if not (np.all(np.abs(lengths - 1.0) < UNIT) and np.isfinite(checked.h).all()):
            raise PlugInError(f"{whose}'s active half-spaces have a normal not of length 1, or an h that is not finite")
        within(whose, "h", checked.h[active], FARTHEST)
        if np.any(checked.binds & ~checked.active[..., None]):
            raise PlugInError(f"{whose}'s binds is true in a slot that is not active")
        return checked


def _equal(one: HalfSpaces, other: HalfSpaces) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("G", "h", "active", "binds"))
