"""A whole run: parts put together, ticks one after the other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from pbrg_mj.governor.optimum import Optimum
from pbrg_mj.governor.passivity import Passivity
from pbrg_mj.governor.problem import Problem
from pbrg_mj.governor.registry import CERTIFICATES, governor, reference_solver
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.loop.tick import Parts, State, tick
from pbrg_mj.perception.perceive import initial
from pbrg_mj.perception.setup import perception_setup
from pbrg_mj.scenario.checks import whole_number
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.sensing.noise import sensor_noise
from pbrg_mj.team.graph import network
from pbrg_mj.team.wind_up import WindUpRule
from pbrg_mj.vehicle.drive import drive_of
from pbrg_mj.world.build import build_world
from pbrg_mj.world.robot import load_robot_model


@dataclass(frozen=True)
class Simulation:
    """One run of a scenario. It can be run once: the world inside moves on."""

    parts: Parts
    ticks: int  # steps of the clock; the records are one more, the last at t = duration

    @classmethod
    def build(cls, scenario: Scenario) -> Simulation:
        """Put a scenario's parts together. Raises InputError when it names something nobody knows."""
        timing, robot, graph = scenario.timing, load_robot_model(), network(scenario)
        answering = governor(scenario)
        parts = Parts(
            scenario=scenario,
            world=build_world(scenario),
            noise=sensor_noise(scenario),
            perception=perception_setup(scenario, robot.clearance, robot.hand_offset),
            network=graph,
            formation=np.array(scenario.team.formation, dtype=float),
            hand_offset=robot.hand_offset,
            certificate=CERTIFICATES[scenario.governor.certificate](scenario, graph),
            governor=answering,
            passivity=getattr(answering, "passivity", _unknown_passivity),
            flow_passivity=getattr(answering, "flow_passivity", _unknown_passivity),
            wind_up_rule=WindUpRule.of(scenario, graph),
            drive=drive_of(scenario, robot),
            reference_solver=reference_solver(scenario),
            reference_every=whole_number(scenario.reference.period, timing.tick),
        )
        return cls(parts, whole_number(timing.duration, timing.tick))

    @property
    def model_xml(self) -> str:
        """MJCF of the world as run; empty for the ideal plant."""
        return self.parts.world.model_xml

    def records(self) -> Iterator[TickRecord]:
        """Yield one record per tick, from t = 0 to t = duration."""
        parts = self.parts
        state = State(None, initial(parts.perception), None, None, np.zeros((parts.network.robots, 2)), None, None)
        for index in range(self.ticks + 1):
            state, record = tick(parts, state, index)
            yield record


def _unknown_passivity(problem: Problem, memory: Any, optimum: Optimum | None = None) -> Passivity:
    """Stand in for governors that do not tell their passivity balances."""
    return Passivity.unknown()
