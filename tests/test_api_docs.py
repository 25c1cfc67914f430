"""What the pages show of the Python API works, in the order they show it: the stranger's script first."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import pbrg_mj as pbrg
from tests.needs import need_module

ROOT = Path(__file__).parents[1]
SNIPPETS = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "api.md").read_text(encoding="utf-8"), re.DOTALL)


def test_the_script_at_the_top_is_short_and_runs_alone(tmp_path):
    need_module("matplotlib")
    lines = [line for line in SNIPPETS[0].splitlines() if line.strip() and not line.lstrip().startswith("#")]
    assert len(lines) <= 15
    (tmp_path / "straight.py").write_text(SNIPPETS[0])
    done = subprocess.run(
        [sys.executable, "straight.py"],
        cwd=tmp_path,
        env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin", "HOME": str(Path.home()), "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    *words, gap, a, b, c = done.stdout.replace("(", "").replace(")", "").split()
    shape = [a, b, c]
    assert " ".join(words) in ("closing in", "stuck", "converged")
    assert 0.0 < float(gap) < 1.0
    assert shape == ["2001,", "5,", "2"]
    assert (tmp_path / "straight.png").stat().st_size > 10_000


def test_all_snippets_work_one_after_the_other(tmp_path, monkeypatch, capsys, request):
    need_module("matplotlib")
    from matplotlib import pyplot as plt

    need_module("xarray")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    space = {"__name__": "page"}
    request.addfinalizer(lambda: plt.close("all"))
    for number, snippet in enumerate(SNIPPETS):
        exec(compile(snippet, f"docs/api.md, snippet {number}", "exec"), space)
    said = capsys.readouterr().out
    assert "\nidentical\n" in said
    assert "governor.runds: is unknown; did you mean `rounds`?; set by override 'governor.runds=3'" in said
    assert "all robots within 2.5 m" in said
    files = {"straight.mcap", "straight.png", "kept.mcap", "mine.pdf", "mine.html", "both.html", "straight.mat"}
    assert {path.name for path in tmp_path.iterdir()} == files


@pytest.mark.render
def test_the_apis_design_reads_as_it_was_meant(tmp_path, monkeypatch):
    need_module("matplotlib")
    need_module("av")
    from matplotlib.figure import Figure

    class MyGovernor:
        def __init__(self, gain):
            self.gain = gain

        def init(self, problem):
            return problem.p.mean(axis=0)

        def step(self, problem, m):
            m = m + 0.01 * self.gain * (problem.reference - m)
            return pbrg.Solution.of(problem, m), m

    monkeypatch.chdir(tmp_path)
    ax = Figure().add_subplot()

    scenario = pbrg.load("paper/experiment_inadmissible", overrides={"operator.reference": [2.0, 1.8]}, seed=7)
    scenario = scenario.override(duration=1.0)
    run = pbrg.run(scenario, governor=MyGovernor(gain=2.0), log="mine.mcap")
    assert (run.metrics.seed, run.q_true_m.shape) == (7, (101, 5, 2))
    assert run.metrics.terminal_gap_m > 0.0
    assert run.optimum.m_star_m.shape == (11, 2)
    run.plot("references", ax=ax)
    run.report("mine.html")
    run.render("mine.mp4", size=(160, 90), fps=10)
    for tick in pbrg.simulate(scenario):
        assert tick.problem.reference.tolist() == [2.0, 1.8]
    again = pbrg.open("mine.mcap")
    table = pbrg.compare(run, again).table()
    assert table.count("object:MyGovernor") == table.count("(centralized)") == 2
    assert {path.name for path in tmp_path.iterdir()} == {"mine.mcap", "mine.html", "mine.mp4"}
    # A run kept in memory can be rendered as well.
    frames = []
    pbrg.run(scenario).render("kept.png", size=(160, 90))
    pbrg.run(scenario).render("kept.mp4", size=(160, 90), fps=10, progress=lambda *done: frames.append(done))
    assert frames == [(k, 10) for k in range(11)]
    assert Path("kept.png").stat().st_size > 0
