"""A physics-based benchmark for distributed reference governors.

    import pbrg_mj as pbrg

    scenario = pbrg.load("paper/experiment_near", overrides={"governor.rounds": 20}, seed=7)
    run = pbrg.run(scenario)
    run.metrics.terminal_gap_m, run.q_true_m.shape
    run.plot("references")

Scenarios   `load`, `draw`, `list_scenarios`, `validate`, `schema`, `template`; `Scenario`
Runs        `run`, `simulate`, `serve`, `batch`, `reproduce`; `Run`, `Batch`, `TickRecord`, `Interrupted`
Studies     `sweep`, `tune`, `bench`, `verify_bench`, `release_bench`, `falsify`; `Sweep`, `Tuning`, `Bench`,
            `BenchVerification`, `Release`, `Falsification`
Logs        `open`, `compare`, `report`, `render`, `verify`, `repair`; `Comparison`, `Verification`, `Repair`
Governors   `RobotProgram`, `RobotFacts`, `TeamConstants`, `OwnData`, `RobotAnswer`: a distributed governor, written for
            one robot; `Governor`, `Problem`, `Solution`, `Status`: one that sees the whole team; `check_governor`
Parts       `Readings`, `HalfSpaces`, `Rows`, `Optimum`: what estimators, certificates and solvers take and give
Besides     `doctor`; `InputError`, `PlugInError`, `PbrgError`; `__version__`

Stable from one minor version to the next are the names in `__all__` with their documented arguments, the names of
arrays (docs/export.md) and metrics (docs/metrics.md), and the keys of a scenario. Everything else, such as the modules
below, may change at any time. docs/api.md shows how to use it.

Importing this is quick: the simulator is loaded with the first name that needs it. It lets the linear algebra of NumPy
and SciPy run on one thread in this process, so that results do not depend on the machine's cores.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from pbrg_mj.blas_threads import limit_blas_threads

__version__ = "0.1.0"

limit_blas_threads()  # before anything here loads NumPy

__all__ = [
    "Batch",
    "Bench",
    "BenchVerification",
    "Comparison",
    "Falsification",
    "Governor",
    "HalfSpaces",
    "InputError",
    "Interrupted",
    "Optimum",
    "OwnData",
    "PbrgError",
    "PlugInError",
    "Problem",
    "Readings",
    "Release",
    "Repair",
    "RobotAnswer",
    "RobotFacts",
    "RobotProgram",
    "Rows",
    "Run",
    "Scenario",
    "Solution",
    "Status",
    "Sweep",
    "TeamConstants",
    "TickRecord",
    "Tuning",
    "Verification",
    "__version__",
    "batch",
    "bench",
    "check_governor",
    "compare",
    "doctor",
    "draw",
    "falsify",
    "list_scenarios",
    "load",
    "open",
    "release_bench",
    "render",
    "repair",
    "report",
    "reproduce",
    "run",
    "schema",
    "serve",
    "simulate",
    "sweep",
    "template",
    "tune",
    "validate",
    "verify",
    "verify_bench",
]

if TYPE_CHECKING:
    from pbrg_mj.api.batch import Batch, batch
    from pbrg_mj.api.checking import check_governor
    from pbrg_mj.api.compare import Comparison, compare
    from pbrg_mj.api.doctor import doctor
    from pbrg_mj.api.interrupt import Interrupted
    from pbrg_mj.api.logs import open, report  # noqa: A004 - pbrg.open
    from pbrg_mj.api.replay import Repair, Verification, repair, verify
    from pbrg_mj.api.reproduce import reproduce
    from pbrg_mj.api.run import Run
    from pbrg_mj.api.scenario import Scenario, draw, list_scenarios, load, schema, template, validate
    from pbrg_mj.api.simulate import run, serve, simulate
    from pbrg_mj.api.video import render
    from pbrg_mj.errors import InputError, PbrgError, PlugInError
    from pbrg_mj.governor.centralized.optimum import Optimum
    from pbrg_mj.governor.messaging.program import OwnData, RobotAnswer, RobotFacts, RobotProgram, TeamConstants
    from pbrg_mj.governor.problem.interface import Governor, Problem, Solution, Status
    from pbrg_mj.governor.problem.rows import Rows
    from pbrg_mj.loop.record import TickRecord
    from pbrg_mj.perception.half_spaces import HalfSpaces
    from pbrg_mj.sensing.readings import Readings
    from pbrg_mj.studies.bench.bench import Bench, bench
    from pbrg_mj.studies.bench.release import Release, release_bench
    from pbrg_mj.studies.bench.verify import BenchVerification, verify_bench
    from pbrg_mj.studies.falsify import Falsification, falsify
    from pbrg_mj.studies.sweep import Sweep, sweep
    from pbrg_mj.studies.tune import Tuning, tune

_MODULES = {
    "api.batch": ("Batch", "batch"),
    "api.checking": ("check_governor",),
    "api.doctor": ("doctor",),
    "api.compare": ("Comparison", "compare"),
    "api.video": ("render",),
    "api.interrupt": ("Interrupted",),
    "api.reproduce": ("reproduce",),
    "api.replay": ("Repair", "Verification", "repair", "verify"),
    "api.logs": ("open", "report"),
    "api.run": ("Run",),
    "api.scenario": ("Scenario", "draw", "list_scenarios", "load", "schema", "template", "validate"),
    "api.simulate": ("run", "serve", "simulate"),
    "errors": ("InputError", "PbrgError", "PlugInError"),
    "governor.centralized.optimum": ("Optimum",),
    "governor.messaging.program": ("OwnData", "RobotAnswer", "RobotFacts", "RobotProgram", "TeamConstants"),
    "governor.problem.interface": ("Governor", "Problem", "Solution", "Status"),
    "governor.problem.rows": ("Rows",),
    "loop.record": ("TickRecord",),
    "perception.half_spaces": ("HalfSpaces",),
    "sensing.readings": ("Readings",),
    "studies.bench.bench": ("Bench", "bench"),
    "studies.bench.release": ("Release", "release_bench"),
    "studies.bench.verify": ("BenchVerification", "verify_bench"),
    "studies.falsify": ("Falsification", "falsify"),
    "studies.sweep": ("Sweep", "sweep"),
    "studies.tune": ("Tuning", "tune"),
}
_HOMES = {name: f"{__name__}.{module}" for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names with the module's own."""
    return sorted({*globals(), *__all__})
