"""A whole run: parts put together, ticks one after the other.

MuJoCo's step takes the processor's caches for itself, so that everything between two of them runs at half its speed or
less. What is not needed for the next tick is therefore done for some ticks in a row.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from time import perf_counter

import numpy as np

from pbrg_mj.governor.monitor.passivity_monitor import passivity_monitor
from pbrg_mj.governor.plug_in import PlugInGovernor
from pbrg_mj.governor.registry import CERTIFICATES, governor, reference_solver
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.loop.tick import Decision, Parts, State, decide
from pbrg_mj.loop.watch import Passed, Watch, Watched, judge
from pbrg_mj.perception.perceive import initial
from pbrg_mj.perception.setup import perception_setup
from pbrg_mj.scenario.schema import Scenario, whole_number
from pbrg_mj.sensing.noise import sensor_noise
from pbrg_mj.team.graph import network
from pbrg_mj.team.wind_up import WindUpDetector
from pbrg_mj.vehicle.drive import drive_of
from pbrg_mj.world.plant.build import build_plant
from pbrg_mj.world.scene.robot import load_robot_model

AHEAD = 100  # ticks
PATIENCE = 0.1  # wall clock [s]: of a slow world, fewer ticks pass at a time


@dataclass(frozen=True)
class Simulation:
    """One run of a scenario. It can be run once: the world inside moves on."""

    parts: Parts
    watch: Watch
    ticks: int  # steps of the clock; the records are one more, the last at t = duration
    ahead: int  # ticks that pass before they are judged

    @classmethod
    def build(cls, scenario: Scenario) -> Simulation:
        """Put a scenario's parts together. Raises InputError when it names something nobody knows."""
        timing, robot, graph = scenario.timing, load_robot_model(), network(scenario)
        answering = governor(scenario)
        parts = Parts(
            scenario=scenario,
            world=build_plant(scenario),
            noise=sensor_noise(scenario),
            perception=perception_setup(scenario, robot.clearance, robot.hand_offset),
            network=graph,
            formation=np.array(scenario.team.formation, dtype=float),
            hand_offset=robot.hand_offset,
            certificate=CERTIFICATES[scenario.governor.certificate](scenario, graph),
            governor=answering,
            drive=drive_of(scenario, robot),
        )
        balances = passivity_monitor(answering)
        watch = Watch(
            wind_up_rule=WindUpDetector.of(scenario, graph),
            passivities=balances.about_optima,
            flow_passivities=balances.of_velocity,
            reference_solver=reference_solver(scenario),
            reference_every=whole_number(scenario.reference.period, timing.tick),
        )
        # A plug-in may write into its memory, so it is judged before its next step.
        ahead = 1 if isinstance(answering, PlugInGovernor) else AHEAD
        return cls(parts, watch, whole_number(timing.duration, timing.tick), ahead)

    @property
    def model_xml(self) -> str:
        """MJCF of the world as run; empty for the ideal plant."""
        return self.parts.world.model_xml

    def decisions(self) -> Iterator[Decision]:
        """Yield what was done in every tick, from t = 0 to t = duration: the closed loop, and nothing beside it."""
        for decision in self._decided():
            yield decision
            self.parts.world.advance(decision.command)

    def records(self) -> Iterator[TickRecord]:
        """Yield one record per tick, from t = 0 to t = duration; the world is up to `ahead` ticks ahead of it.

        The first comes at once: whoever takes it has things to set up. What a tick raises comes after the records of
        the ticks before it.
        """
        decided, watched, going, ticks = self._decided(), Watched(), True, 1
        while going:
            passed, failure = self._pass(decided, ticks)
            ticks = self.ahead
            if passed:
                watched, records = judge(self.watch, watched, passed)
                yield from records
            if failure:
                raise failure
            going = bool(passed)

    def _pass(self, decided: Iterator[Decision], ticks: int) -> tuple[list[Passed], Exception | None]:
        """Let up to so many ticks pass; return them, none after the last one, and what ended them early."""
        world, passed, until = self.parts.world, [], perf_counter() + PATIENCE
        try:
            for decision in islice(decided, ticks):
                began = perf_counter()
                truth = world.truth()
                looked = perf_counter()
                world.advance(decision.command)
                now = perf_counter()
                passed.append(Passed(truth, decision, looked - began, now - looked))
                if now > until:
                    break
        except Exception as error:
            return passed, error
        return passed, None

    def _decided(self) -> Iterator[Decision]:
        """Yield every tick's decision; whoever asks for the next has let the world move on."""
        parts = self.parts
        xi = np.zeros((parts.network.robots, 2))
        state = State(None, initial(parts.perception), None, None, None, xi)
        for index in range(self.ticks + 1):
            state, decision = decide(parts, state, index)
            yield decision
