"""Where the time of worlds side by side goes, in processor time of one thread.

    PYTHONPATH=scripts python -m performance.batch_profile

Prints microseconds per world and tick: of the stages of `pbrg batch`, and of bare physics with and without its beams
and contacts.
"""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from time import process_time
from typing import Any

import mujoco
import numpy as np

from pbrg_mj.loop.batch import BatchSimulation
from pbrg_mj.loop.batch_control import CertifiedBatch, DistributedBatch
from pbrg_mj.loop.batch_group import WorldGroup
from pbrg_mj.world.plant.batch import PlantBatch
from performance.batch import WORLDS
from performance.closed_loop import RECOMMENDED, bare_model, recorded_commands, scenario

DURATION = "timing.duration=0.5"
TURNS = 20
STAGES = (
    (PlantBatch, "advance", "physics"),
    (PlantBatch, "truth", "truth"),
    (WorldGroup, "_sense_and_perceive", "sensing and perception"),
    (DistributedBatch, "step", "governor and control"),
    (CertifiedBatch, "step", "governor and control"),
    (WorldGroup, "_violated", "certificates"),
)
DISABLED = {
    "bare": (),
    "without beams": ("SENSOR",),
    "without contacts": ("CONTACT",),
    "without both": ("SENSOR", "CONTACT"),
}


@contextmanager
def timed(spent: dict[str, float]) -> Iterator[None]:
    """Add up the processor time of every stage."""

    def wrapped(function: Any, label: str) -> Any:
        def call(*arguments: Any, **keys: Any) -> Any:
            began = process_time()
            try:
                return function(*arguments, **keys)
            finally:
                spent[label] += process_time() - began

        return call

    before = [(owner, name, getattr(owner, name)) for owner, name, _ in STAGES]
    for owner, name, label in STAGES:
        setattr(owner, name, wrapped(getattr(owner, name), label))
    try:
        yield
    finally:
        for owner, name, function in before:
            setattr(owner, name, function)


def batch_stages(*overrides: str) -> dict[str, float]:
    """Return seconds of every stage of `pbrg batch`."""
    plan = scenario(DURATION, *overrides).scenario
    BatchSimulation(plan, range(1, 3), 1).run()  # compile
    spent: dict[str, float] = defaultdict(float)
    with timed(spent):
        BatchSimulation(plan, range(1, WORLDS + 1), 1).run()
    return dict(spent)


def bare_physics() -> dict[str, float]:
    """Return seconds of a tick of mj_step with parts of the physics switched off, the best of many turns."""
    loaded, best = scenario(DURATION), dict.fromkeys(DISABLED, np.inf)
    timing, model, commands = loaded.scenario.timing, bare_model(loaded), recorded_commands(loaded)
    substeps, whole = round(timing.tick / timing.physics_step), model.opt.disableflags
    for _ in range(TURNS):
        for name, off in DISABLED.items():
            model.opt.disableflags = whole | sum(int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{one}")) for one in off)
            data, began = mujoco.MjData(model), process_time()
            for command in commands:
                data.ctrl[:] = command
                mujoco.mj_step(model, data, substeps)
            best[name] = min(best[name], (process_time() - began) / len(commands))
    return best


def main() -> int:
    ticks = WORLDS * len(recorded_commands(scenario(DURATION)))
    for title, overrides in (("the paper's governor", ()), ("the recommended set-up", RECOMMENDED)):
        stages = batch_stages(*overrides)
        print(f"{title}, {WORLDS} worlds")
        for name, seconds in stages.items():
            print(f"  {name:<34}{seconds / ticks * 1e6:8.1f}")
        physics = sum(seconds for name, seconds in stages.items() if name.startswith("physics"))
        print(f"  {'physics, share of all':<34}{physics / sum(stages.values()):8.2f}")
    print("one world's mj_step alone")
    for name, seconds in bare_physics().items():
        print(f"  {name:<34}{seconds * 1e6:8.1f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
