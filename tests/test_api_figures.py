"""Axes in, axes out."""

from __future__ import annotations

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.analysis.figures.figure import PANELS
from tests.needs import need_module
from tests.runs import run, walled

need_module("matplotlib")
import matplotlib as mpl  # noqa: E402

mpl.use("Agg")
from matplotlib import pyplot as plt  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402


@pytest.fixture
def made():
    yield pbrg.Run(run(walled()))
    plt.close("all")


@pytest.mark.parametrize("panel", [name for name in PANELS if name != "references"])
def test_axes_go_in_and_come_out(made, panel):
    figure = Figure()
    ax = figure.add_subplot(1, 2, 1)
    assert made.plot(panel, ax=ax) is ax
    assert figure.axes == [ax]
    assert ax.lines or ax.collections
    assert ax.get_xlabel() == ("x [m]" if panel == "trajectories" else "time [s]")
    assert plt.get_fignums() == []


def test_without_axes_there_are_new_ones_that_a_notebook_shows(made):
    ax = made.plot()
    assert ax.figure.number in plt.get_fignums()
    above, below = made.plot("references")
    assert above.figure is below.figure
    assert (above.get_ylabel(), below.get_ylabel()) == ("$m_x$ [m]", "$m_y$ [m]")


def test_references_take_two_axes_or_share_out_one(made):
    figure = Figure()
    two = figure.subplots(2, 1)
    assert made.plot("references", ax=two) == tuple(two)
    one = Figure().add_subplot()
    above, below = made.plot("references", ax=one)
    assert one.child_axes == [above, below]
    assert not one.axison
    m = made.m_m
    for axes, component in ((above, 0), (below, 1)):
        drawn = [line.get_ydata() for line in axes.lines[: m.shape[1]]]
        np.testing.assert_array_equal(np.array(drawn).T, m[..., component])
        assert axes.get_xlim() == (0.0, 10.0)
    top, bottom = above.get_position(), below.get_position()
    assert bottom.y1 < top.y0


@pytest.mark.parametrize("ax", [3, [1, 2], []])
def test_what_is_no_axes_is_refused(made, ax):
    with pytest.raises(pbrg.InputError, match=r"allowed: one of matplotlib's Axes, or 2"):
        made.plot("references", ax=ax)


def test_two_axes_for_one_part_are_refused(made):
    with pytest.raises(pbrg.InputError, match=r"allowed: one of matplotlib's Axes$"):
        made.plot("gap", ax=Figure().subplots(1, 2))


def test_an_unknown_panel_is_refused(made):
    with pytest.raises(pbrg.InputError, match="there is no panel 'gaps'; allowed: trajectories"):
        made.plot("gaps")


def test_the_figure_is_the_commands_file(made, tmp_path):
    figure = made.figure(path=tmp_path / "a.svg")
    assert len(figure.axes) == 3
    pbrg.Run(run(walled())).figure("trajectories,references", tmp_path / "b.svg")
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    assert len(made.figure("all").axes) == 7
    assert len(made.figure(["gap", "margin"]).axes) == 2
    with pytest.raises(pbrg.InputError, match=r"allowed: \.pdf, \.png, \.svg"):
        made.figure(path=tmp_path / "a.gif")
