import subprocess
import sys

import numpy as np
import pytest

from pbrg_mj.errors import InputError
from tests.runs import resting, run, walled

pytest.importorskip("matplotlib")
MAGIC = {".pdf": b"%PDF", ".png": b"\x89PNG", ".svg": b"<?xml"}


def travelling():
    plan = walled()
    path = np.linspace(-2.0, 0.0, 21)[:, None, None]
    return run(plan, ticks={"hand_true": resting(plan).hand_true + path, "m": resting(plan).m + path})


@pytest.mark.parametrize("suffix", MAGIC)
def test_figures_of_each_kind_with_the_same_bytes_each_time(tmp_path, suffix):
    from pbrg_mj.analysis.plot import plot

    for name in "ab":
        plot(travelling(), tmp_path / f"{name}{suffix}")
    first, second = ((tmp_path / f"{name}{suffix}").read_bytes() for name in "ab")
    assert first.startswith(MAGIC[suffix])
    assert len(first) > 5000
    assert first == second


def test_other_runs_give_other_figures(tmp_path):
    from pbrg_mj.analysis.plot import plot

    plot(run(), tmp_path / "a.png")
    plot(travelling(), tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() != (tmp_path / "b.png").read_bytes()


def team_of(robots):
    places = tuple((0.4 * k, 0.0) for k in range(robots))
    return walled(team={"start": places, "formation": places, "leaders": (1,)})


@pytest.mark.parametrize("robots", [2, 7, 8, 20, 50])
def test_robots_are_told_apart_and_the_legend_stays_short(robots):
    from pbrg_mj.analysis.plot import _label, _look

    looks = [(str(look["color"]), str(look["linestyle"])) for look in (_look(k, robots) for k in range(robots))]
    assert len(set(looks)) == robots
    labels = [_label(k, robots) for k in range(robots)]
    assert labels[0] == "$m_{1}$"
    assert labels[-1] == f"$m_{{{robots}}}$"
    assert sum(label is not None for label in labels) == (robots if robots <= 8 else 2)


def test_twenty_robots_can_be_drawn(tmp_path):
    from pbrg_mj.analysis.plot import plot

    plot(run(team_of(20)), tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 5000


def test_a_diverged_run_can_be_drawn(tmp_path):
    from pbrg_mj.analysis.plot import plot

    m = resting(walled()).m.copy()
    m[7:] = np.nan
    plot(run(walled(), ticks={"m": m}), tmp_path / "a.svg")
    assert (tmp_path / "a.svg").stat().st_size > 5000


def test_without_matplotlib_one_line_says_what_to_install(tmp_path, monkeypatch):
    from pbrg_mj.analysis.plot import plot

    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(InputError, match=r"pip install 'pbrg-mj\[plot\]'"):
        plot(run(), tmp_path / "a.png")
    assert not list(tmp_path.iterdir())


def test_matplotlib_is_imported_only_to_draw():
    code = "import sys, pbrg_mj.analysis.plot; assert 'matplotlib' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
