"""The governor page's example, offered by another package, runs as the page says."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

from pbrg_mj import plugins
from pbrg_mj.errors import InputError, PlugInError
from pbrg_mj.governor.monitor.passivity import Passivity
from pbrg_mj.governor.plug_in import PlugInGovernor
from pbrg_mj.governor.problem.interface import Solution
from pbrg_mj.governor.problem.rows import row_values
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario

PAGE = Path(__file__).parents[1] / "docs" / "governor.md"


def short(kind):
    return load_scenario("paper/simulation_near", ["timing.duration=5", f"governor.kind={kind}"]).scenario


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """The page's code as an installed package."""
    code = re.search(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    (tmp_path / "my_package.py").write_text(code.group(1))
    info = tmp_path / "my_package-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-package\nVersion: 1.0\n")
    entry = re.search(r"```toml\n(.*?)```", PAGE.read_text(), re.DOTALL).group(1)
    group, line = entry.strip().splitlines()
    group = group.removeprefix("[project.entry-points.").strip('"]')
    (info / "entry_points.txt").write_text(f"[{group}]\n{line.replace(chr(34), '')}\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield
    sys.modules.pop("my_package", None)


@pytest.mark.usefixtures("installed")
def test_the_pages_example_runs_and_keeps_its_certificate():
    records = list(Simulation.build(short("scalar")).records())
    for record in records:
        worst = row_values(record.problem.rows, record.solution.m[4], record.problem.p, record.problem.xi).max()
        assert worst <= 1e-9 or record.solution.status == "infeasible"
    assert np.linalg.norm(records[-1].solution.m[4] - records[0].solution.m[4]) > 0.3


def test_an_unknown_governor_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match=r"governor.kind: no governor is called 'fancy'; allowed: distributed"):
        Simulation.build(short("fancy"))


@pytest.mark.parametrize("kind", ["centralized", "none"])
def test_baselines_run(kind):
    last = None
    for last in Simulation.build(short(kind)).records():
        if kind == "none":
            np.testing.assert_array_equal(last.solution.m, np.tile([1.0, 2.0], (5, 1)))
        elif last.optimum is not None:
            np.testing.assert_allclose(last.solution.m[0], last.optimum.m, atol=1e-5)
    assert last is not None


class Reusing:
    """A careless plug-in: one array for all its answers, written anew each tick."""

    def __init__(self) -> None:
        self.m = np.zeros((5, 2))

    def init(self, problem):
        return 0

    def step(self, problem, memory):
        self.m[:] = memory
        return Solution(self.m, np.zeros_like(problem.rows.d), "ok", 0, np.zeros(5, dtype=np.int64)), memory + 1

    def passivity(self, problem, memory, optimum):
        return Passivity(1.0, 2.0, 3.0, 4.0)


def test_a_governor_that_reuses_its_arrays_changes_no_earlier_answer(monkeypatch):
    entry = EntryPoint("reusing", "tests.test_own_governor:reusing", plugins.GOVERNOR.group)
    monkeypatch.setattr(plugins, "entry_points", lambda group: [entry])
    records = list(Simulation.build(short("reusing")).records())
    assert [record.solution.m[0, 0] for record in records[:4]] == [0.0, 1.0, 2.0, 3.0]
    assert records[0].passivity == Passivity(1.0, 2.0, 3.0, 4.0)
    assert np.isnan(records[0].flow_passivity.primal_storage)


def reusing(scenario):
    return Reusing()


class Scribbling(Reusing):
    """A plug-in that writes into its memory, and returns a balance of it."""

    def init(self, problem):
        return np.zeros(1)

    def step(self, problem, memory):
        memory += 1.0
        return super().step(problem, memory[0])[0], memory

    def passivity(self, problem, memory, optimum):
        return Passivity(memory[0], 0.0, 0.0, 0.0)


def test_a_governor_that_writes_into_its_memory_is_judged_before_its_next_step(monkeypatch):
    entry = EntryPoint("scribbling", "tests.test_own_governor:scribbling", plugins.GOVERNOR.group)
    monkeypatch.setattr(plugins, "entry_points", lambda group: [entry])
    for record in Simulation.build(short("scribbling")).records():
        if record.passivity is not None:
            assert record.passivity.primal_storage == record.index + 1.0


def scribbling(scenario):
    return Scribbling()


class Answering(Reusing):
    """A plug-in with an answer of any kind."""

    def __init__(self, **arrays):
        super().__init__()
        self.arrays = arrays

    def step(self, problem, memory):
        solution, memory = super().step(problem, memory)
        return replace(solution, **self.arrays), memory


def answer(**arrays):
    run = Simulation.build(short("none"))
    decision = next(run.control_ticks())
    return PlugInGovernor(Answering(**arrays)).step(decision.problem, decision.memory or 0)[0]


def test_whole_numbers_and_lists_are_taken_for_what_they_say():
    solution = answer(m=np.arange(10).reshape(5, 2), bytes_sent=[1, 2, 3, 4, 5])
    assert (solution.m.dtype, solution.bytes_sent.dtype) == (np.float64, np.int64)
    np.testing.assert_array_equal(solution.m.ravel(), np.arange(10.0))


@pytest.mark.parametrize(("name", "shape"), [("m", (2, 5)), ("multipliers", (5, 1)), ("lost", (5, 1))])
def test_arrays_of_another_shape_are_named(name, shape):
    with pytest.raises(PlugInError, match=rf"the governor's {name} has shape .*, not \(5"):
        answer(**{name: np.zeros(shape)})
