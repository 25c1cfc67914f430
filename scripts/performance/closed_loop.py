"""The closed loop against bare mj_step of the same model with the same voltages."""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from statistics import median
from time import perf_counter

import mujoco
import numpy as np

from pbrg_mj.api.garbage_collection import settle
from pbrg_mj.log.write.writer import LogWriter
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.loop.tick_data import ControlTick
from pbrg_mj.scenario.load import LoadedScenario, load_scenario
from performance.timing import REPEATS

SCENARIO = "paper/experiment_near"
BEAMS = ("sensors.beams.robots=all", "sensors.beams.count=72", "sensors.beams.rate_hz=10", "governor.rounds=10")
RECOMMENDED = ("set_up=recommended",)
DURATION = 8.0  # [s]; both sides see the same part of the run
TURN = 200  # ticks before the other side has its turn


@dataclass
class Side:
    """One of two that take turns over the same ticks."""

    step: Callable[[int], object]  # runs so many ticks
    seconds: float = 0.0

    def turn(self, ticks: int) -> None:
        """Run so many ticks and add up the time."""
        begin = perf_counter()
        self.step(ticks)
        self.seconds += perf_counter() - begin


def scenario(*overrides: str) -> LoadedScenario:
    """Return the scenario that all figures are about, without a reference unless an override brings one."""
    fixed = (*BEAMS, f"timing.duration={DURATION}", "reference.solver=none")
    return load_scenario(SCENARIO, [*fixed, *overrides])


def closed_loop() -> dict[str, float]:
    """Return the ratios to bare mj_step, plain, with the recommended set-up and logged, and the share of the log."""
    settle()  # as `pbrg run` does
    plain, certified = scenario(), scenario(*RECOMMENDED)
    full = scenario("reference.solver=clarabel", "reference.period=0.01")
    commands = recorded_commands(plain)
    bare = [_against_bare(_decisions(plain), plain, commands) for _ in range(REPEATS)]
    certified_commands = recorded_commands(certified)
    recommended = [_against_bare(_decisions(certified), certified, certified_commands) for _ in range(REPEATS)]
    logged = [_logged(full, commands) for _ in range(REPEATS)]
    return {
        "closed_loop_over_bare": median(ratio for ratio, _ in bare),
        "recommended_over_bare": median(ratio for ratio, _ in recommended),
        "bare_tick_us": median(seconds for _, seconds in bare) * 1e6,
        "logged_with_reference_over_bare": median(ratio for ratio, _ in logged),
        "log_over_tick": median(share for _, share in logged),
    }


def bare_ticks(model: mujoco.MjModel, loaded: LoadedScenario, commands: np.ndarray) -> Callable[[int], None]:
    """Return what steps the model alone, a tick's command after the other."""
    data, given = mujoco.MjData(model), iter(commands)
    substeps = round(loaded.scenario.timing.tick / loaded.scenario.timing.physics_step)

    def step(ticks: int) -> None:
        for command in islice(given, ticks):
            data.ctrl[:] = command
            mujoco.mj_step(model, data, substeps)

    return step


def _decisions(loaded: LoadedScenario) -> Iterator[ControlTick]:
    return Simulation.build(loaded.scenario).control_ticks()


def recorded_commands(loaded: LoadedScenario) -> np.ndarray:
    """Return the voltages (ticks, motors) of a run, in the order of the model's actuators."""
    return np.array([decision.command.ravel() for decision in _decisions(loaded)])


def bare_model(loaded: LoadedScenario) -> mujoco.MjModel:
    """Return the scenario's model as a run has it."""
    return mujoco.MjModel.from_xml_string(Simulation.build(loaded.scenario).model_xml)


def _against_bare(run: Iterator[object], loaded: LoadedScenario, commands: np.ndarray) -> tuple[float, float]:
    """Return the ratio of the times of all ticks, and a bare tick [s]."""

    def step(ticks: int) -> None:
        for _ in islice(run, ticks):
            pass

    ours, bare = Side(step), Side(bare_ticks(bare_model(loaded), loaded, commands))
    ours.step(1)  # opens files
    bare.step(1)
    for first in range(1, len(commands), TURN):
        ours.turn(min(TURN, len(commands) - first))
        bare.turn(min(TURN, len(commands) - first))
    return ours.seconds / bare.seconds, bare.seconds / (len(commands) - 1)


def _logged(loaded: LoadedScenario, commands: np.ndarray) -> tuple[float, float]:
    """Return the ratio to bare of a run with reference and log, and the log's time over the rest of the tick's."""
    simulation, writing = Simulation.build(loaded.scenario), 0.0
    with tempfile.TemporaryDirectory() as folder:
        write = LogWriter(Path(folder) / "log.mcap", loaded, simulation.model_xml)

        def logged() -> Iterator[TickRecord]:
            nonlocal writing
            with write:
                for record in simulation.records():
                    begin = perf_counter()
                    write(record)
                    writing += perf_counter() - begin if record.index else 0.0
                    yield record

        ratio, tick = _against_bare(logged(), loaded, commands)
    return ratio, writing / (ratio * tick * (len(commands) - 1) - writing)
