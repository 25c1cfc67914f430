"""A whole run: the closed loop put together, ticks one after the other.

MuJoCo's step takes the processor's caches for itself, so that everything between two of them runs at half its speed or
less. What is not needed for the next tick is therefore done for some ticks in a row.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from pbrg_mj.governor.monitor.passivity_monitor import passivity_monitor
from pbrg_mj.governor.plug_in import PlugInGovernor
from pbrg_mj.governor.problem.interface import Governor
from pbrg_mj.governor.registry import certificate, governor, reference_solver, velocity_filters
from pbrg_mj.governor.velocity_filter.interface import VelocityFilter
from pbrg_mj.kernel import clock
from pbrg_mj.loop.closed_loop import ClosedLoop
from pbrg_mj.loop.compiled_control import CompiledControl
from pbrg_mj.loop.monitor import CompletedTick, Monitor, MonitorState, evaluate
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.loop.resources import check_memory
from pbrg_mj.loop.tick import control_tick, initial_state
from pbrg_mj.loop.tick_data import ControlTick
from pbrg_mj.perception.estimator import estimator
from pbrg_mj.plugins import Objects, is_centralized
from pbrg_mj.scenario.schema import Scenario, whole_number
from pbrg_mj.sensing.noise import sensor_noise
from pbrg_mj.team.exchange import exchange
from pbrg_mj.team.graph import network
from pbrg_mj.team.wind_up import WindUpDetector
from pbrg_mj.vehicle.drive import Drive, drive_of
from pbrg_mj.vehicle.motor_lag import motor_lag
from pbrg_mj.world.plant.build import build_plant
from pbrg_mj.world.scene.robot import load_robot_model

BLOCK_TICKS = 100
BLOCK_SECONDS = 0.1  # wall clock [s]: of a slow world, fewer ticks pass at a time


@dataclass(frozen=True)
class Simulation:
    """One run of a scenario. It can be run once: the world inside moves on."""

    loop: ClosedLoop
    monitor: Monitor
    ticks: int  # steps of the clock; the records are one more, the last at t = duration
    block_ticks: int  # ticks that pass before they are evaluated
    centralized: bool  # whether the governor sees the whole team

    @classmethod
    def build(cls, scenario: Scenario, objects: Objects = Objects()) -> Simulation:  # noqa: B008 - a frozen tuple
        """Put a scenario's closed loop together; `objects` take the place of what the scenario names.

        Raises InputError when the scenario names something unknown or needs more memory than there is, PlugInError when
        a plug-in cannot be built.
        """
        check_memory(scenario)
        timing, robot, graph = scenario.timing, load_robot_model(scenario.robot), network(scenario)
        chosen = governor(scenario, objects.governor)
        drive, filters = drive_of(scenario, robot), velocity_filters(scenario)
        loop = ClosedLoop(
            scenario=scenario,
            world=build_plant(scenario),
            noise=sensor_noise(scenario, objects.noise_model),
            estimator=estimator(scenario, robot, objects.estimator),
            network=graph,
            formation=np.array(scenario.team.formation, dtype=float),
            hand_offset=robot.hand_offset,
            certificate=certificate(scenario, objects.certificate),
            governor=chosen,
            drive=drive,
            velocity_filters=filters,
            exchange=exchange(scenario),
            compiled_control=_compiled_control(scenario, drive, filters),
        )
        balances = passivity_monitor(chosen)
        monitor = Monitor(
            wind_up_rule=WindUpDetector.of(scenario, graph),
            passivities=balances.about_optima,
            flow_passivities=balances.of_velocity,
            reference_solver=reference_solver(scenario, objects.reference_solver),
            reference_every=whole_number(scenario.reference.period, timing.tick),
        )
        # A plug-in may write into its memory, so it is evaluated before its next step.
        block_ticks = 1 if isinstance(chosen, PlugInGovernor) else BLOCK_TICKS
        centralized = is_centralized(scenario.governor.kind, objects.governor)
        return cls(loop, monitor, whole_number(timing.duration, timing.tick), block_ticks, centralized)

    def governed_by(self, chosen: Governor) -> Simulation:
        """Return the same run with another governor."""
        balances = passivity_monitor(chosen)
        monitor = replace(self.monitor, passivities=balances.about_optima, flow_passivities=balances.of_velocity)
        return replace(self, loop=replace(self.loop, governor=chosen), monitor=monitor)

    @property
    def model_xml(self) -> str:
        """MJCF of the world as run; empty for the ideal plant."""
        return self.loop.world.model_xml

    def control_ticks(self) -> Iterator[ControlTick]:
        """Yield what was done in every tick, from t = 0 to t = duration: the closed loop, and nothing beside it."""
        for tick in self._run_ticks():
            yield tick
            self.loop.world.advance(tick.command)

    def records(self) -> Iterator[TickRecord]:
        """Yield one record per tick, from t = 0 to t = duration; the world is up to `block_ticks` ahead.

        The first comes at once, for sinks that set themselves up with it. What a tick raises comes after the records of
        the ticks before it.
        """
        run_ticks, monitored, going, ticks = self._run_ticks(), MonitorState(), True, 1
        while going:
            completed, failure = self._run_block(run_ticks, ticks)
            ticks = self.block_ticks
            if completed:
                monitored, records = evaluate(self.monitor, monitored, completed)
                yield from records
            if failure:
                raise failure
            going = bool(completed)

    def _run_block(self, run_ticks: Iterator[ControlTick], ticks: int) -> tuple[list[CompletedTick], Exception | None]:
        """Let up to so many ticks pass; return them, none after the last one, and what ended them early."""
        world, passed, samples, failure, until = self.loop.world, [], [], None, clock() + BLOCK_SECONDS
        try:
            for tick in islice(run_ticks, ticks):
                began = clock()
                sample = world.sample_truth()
                looked = clock()
                world.advance(tick.command)
                now = clock()
                samples.append(sample)
                passed.append((tick, looked - began, now - looked))
                if now > until:
                    break
        except Exception as error:
            failure = error
        if not passed:
            return [], failure
        began = clock()
        truths = world.truths(samples)
        each = (clock() - began) / len(passed)
        completed = [
            CompletedTick(truth, tick, sampling + each, advancing)
            for truth, (tick, sampling, advancing) in zip(truths, passed, strict=True)
        ]
        return completed, failure

    def _run_ticks(self) -> Iterator[ControlTick]:
        """Yield every tick; the caller advances the world before it asks for the next."""
        loop, state = self.loop, initial_state(self.loop)
        for index in range(self.ticks + 1):
            state, tick = control_tick(loop, state, index)
            yield tick


def _compiled_control(scenario: Scenario, drive: Drive, filters: tuple[VelocityFilter, ...]) -> CompiledControl | None:
    """Return the control in one call; None where a part of it is not compiled, or needs what lies between the parts."""
    at_once = exchange(scenario) is None and motor_lag(scenario) is None
    return CompiledControl.of(scenario, drive, filters) if at_once and scenario.governor.backend == "compiled" else None
