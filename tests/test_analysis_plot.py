import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pbrg_mj.cli.main import main
from pbrg_mj.errors import InputError
from tests.needs import need_module
from tests.runs import resting, run, scenario, walled

need_module("matplotlib")
MAGIC = {".pdf": b"%PDF", ".png": b"\x89PNG", ".svg": b"<?xml"}


def travelling():
    plan = walled()
    path = np.linspace(-2.0, 0.0, 21)[:, None, None]
    return run(plan, ticks={"hand_true": resting(plan).hand_true + path, "m": resting(plan).m + path})


@pytest.mark.parametrize("suffix", MAGIC)
def test_figures_of_each_kind_with_the_same_bytes_each_time(tmp_path, suffix):
    from pbrg_mj.analysis.figures.figure import plot

    for name in "ab":
        plot(travelling(), tmp_path / f"{name}{suffix}")
    first, second = ((tmp_path / f"{name}{suffix}").read_bytes() for name in "ab")
    assert first.startswith(MAGIC[suffix])
    assert len(first) > 5000
    assert first == second


def test_other_runs_give_other_figures(tmp_path):
    from pbrg_mj.analysis.figures.figure import plot

    plot(run(), tmp_path / "a.png")
    plot(travelling(), tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() != (tmp_path / "b.png").read_bytes()


def team_of(robots):
    places = tuple((0.4 * k, 0.0) for k in range(robots))
    return walled(team={"start": places, "formation": places, "leaders": (1,)})


@pytest.mark.parametrize("robots", [2, 7, 8, 20, 50])
def test_robots_are_told_apart_and_the_legend_stays_short(robots):
    from pbrg_mj.analysis.figures.style import label, robot_style

    looks = [
        (str(style["color"]), str(style["linestyle"])) for style in (robot_style(k, robots) for k in range(robots))
    ]
    assert len(set(looks)) == robots
    labels = [label("m", k, robots) for k in range(robots)]
    assert labels[0] == "$m_{1}$"
    assert labels[-1] == f"$m_{{{robots}}}$"
    assert sum(label is not None for label in labels) == (robots if robots <= 8 else 2)


def test_twenty_robots_can_be_drawn(tmp_path):
    from pbrg_mj.analysis.figures.figure import plot

    plot(run(team_of(20)), tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 5000


def test_a_diverged_run_can_be_drawn(tmp_path):
    from pbrg_mj.analysis.figures.figure import plot

    m = resting(walled()).m.copy()
    m[7:] = np.nan
    plot(run(walled(), ticks={"m": m}), tmp_path / "a.svg")
    assert (tmp_path / "a.svg").stat().st_size > 5000


def test_without_matplotlib_one_line_says_what_to_install(tmp_path, monkeypatch):
    from pbrg_mj.analysis.figures.figure import plot

    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(InputError, match=r"pip install matplotlib"):
        plot(run(), tmp_path / "a.png")
    assert not list(tmp_path.iterdir())


def test_matplotlib_is_imported_only_to_draw():
    code = "import sys, pbrg_mj.analysis.figures.figure; assert 'matplotlib' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def drawn(panel, made):
    """Return the panel's axes, drawn."""
    from matplotlib.figure import Figure

    axes = Figure().add_subplot()
    panel(axes, made)
    return axes


def curve(axes, name):
    return next(line for line in axes.lines if line.get_label() == name)


def test_margins_are_the_least_true_one_the_sensed_one_and_what_the_certificate_leaves():
    from pbrg_mj.analysis.figures.time_histories import margin

    made = run(walled(), ticks={"wall_margin": np.tile([0.3, 0.7], (21, 1))})
    axes = drawn(margin, made)
    assert np.all(curve(axes, "true").get_ydata() == 0.3)
    # the robots rest at x = 1 before x <= 2; at rest the ball has no radius
    np.testing.assert_allclose(curve(axes, "sensed").get_ydata(), 1.0)
    np.testing.assert_allclose(curve(axes, "certified").get_ydata(), 1.0)


def test_a_certificate_that_fails_by_far_does_not_hide_the_margin():
    from pbrg_mj.analysis.figures.time_histories import margin

    far = resting(walled()).xi + 100.0
    axes = drawn(margin, run(walled(), ticks={"xi": far}))
    assert curve(axes, "certified").get_ydata().max() < -100
    assert axes.get_ylim()[0] > -2


def test_the_gap_is_the_distance_to_the_optimum_and_none_is_shaded_where_there_is_none():
    from pbrg_mj.analysis.figures.time_histories import gap

    m = resting(walled()).m.copy()
    m[:, 0] += (0.3, 0.4)
    m[:, 1] += (0.0, 0.1)  # who leads
    made = run(walled(), ticks={"m": m})
    axes = drawn(gap, made)
    np.testing.assert_allclose(curve(axes, "any robot").get_ydata(), 0.5)
    np.testing.assert_allclose(curve(axes, "leaders").get_ydata(), 0.1)
    assert not axes.collections
    made.optima.m[2:4] = np.nan
    axes = drawn(gap, made)
    assert [shade.get_label() for shade in axes.collections] == ["no optimum"]
    assert np.isnan(curve(axes, "any robot").get_ydata()).tolist() == [False, False, True, True, False, False]


def test_multipliers_are_summed_and_a_spike_of_the_optimum_s_does_not_hide_them():
    from pbrg_mj.analysis.figures.time_histories import multipliers

    plan = walled(timing={"duration": 60.0, "tick": 0.5, "physics_step": 0.5})
    made = run(plan)
    made.ticks.multipliers[:] = [[0.1, 0.2], [0.4, 0.0]]
    made.optima.multipliers[:] = 0.25
    axes = drawn(multipliers, made)
    assert np.allclose(curve(axes, "$\\lambda_{1}$").get_ydata(), 0.3)
    assert np.allclose(curve(axes, "$\\Sigma$").get_ydata(), 0.7)
    assert np.allclose(curve(axes, "$\\Sigma^*$").get_ydata(), 1.0)
    assert 1.0 < axes.get_ylim()[1] < 1.2


def test_rounding_has_a_place_on_the_logarithmic_axis():
    from pbrg_mj.analysis.figures.time_histories import LEAST, consensus

    axes = drawn(consensus, run())
    assert np.all(axes.lines[0].get_ydata() == LEAST)
    assert axes.get_yscale() == "log"


def without_optima():
    made = run()
    return run(optima=type(made.optima)(**{name: value[:0] for name, value in vars(made.optima).items()}))


def of_one_tick():
    return run(walled(), ticks={name: value[:1] for name, value in vars(resting(walled())).items()})


def diverged():
    whole = resting(walled())
    ticks = {name: getattr(whole, name).astype(float).copy() for name in ("m", "hand_true", "multipliers", "xi")}
    for values in ticks.values():
        values[7:] = np.nan
        values[6] = np.inf
    return run(walled(), ticks=ticks)


def open_field():
    plan = scenario(plant="physics", estimator={})
    nothing = np.zeros((21, 2, 1), dtype=bool)
    nobody = np.zeros((*nothing.shape, 2), dtype=bool)
    return run(
        plan, ticks={"wall_margin": np.full((21, 2), np.inf), "half_space_active": nothing, "half_space_binds": nobody}
    )


@pytest.mark.parametrize("made", [run, travelling, without_optima, of_one_tick, diverged, open_field])
def test_every_panel_can_be_drawn_of_every_run(tmp_path, made):
    from pbrg_mj.analysis.figures.figure import PANELS, plot

    plot(made(), tmp_path / "a.png", tuple(PANELS))
    assert (tmp_path / "a.png").stat().st_size > 20_000


@pytest.mark.parametrize(
    ("panels", "columns"),
    [
        (("gap",), [["gap"]]),
        (("trajectories", "references"), [["trajectories"], ["references"]]),
        (("trajectories", "gap", "margin", "consensus"), [["trajectories", "consensus"], ["gap", "margin"]]),
    ],
)
def test_panels_go_where_there_is_most_room(panels, columns):
    from pbrg_mj.analysis.figures.figure import _columns

    assert _columns(panels) == columns


def test_panels_are_chosen_on_the_command_line(tmp_path, monkeypatch, capsys):
    from pbrg_mj.analysis.figures import figure
    from pbrg_mj.api import logs as api_logs

    monkeypatch.chdir(tmp_path)
    Path("a.mcap").touch()
    drawn_panels = []
    monkeypatch.setattr(api_logs, "open_reduced", lambda path, quantities: (run(), run()))
    monkeypatch.setattr(api_logs, "plot", lambda run, path, panels: drawn_panels.append(panels))
    for wanted in ([], ["--panels", "gap,margin,gap"], ["--panels", "all"]):
        assert main(["plot", "a.mcap", "-o", "a.pdf", *wanted]) == 0
    assert drawn_panels == [figure.PAPER, ("gap", "margin"), tuple(figure.PANELS)]
    for wrong, said in (("walls", "there is no panel 'walls'"), (",", "no panel is asked for")):
        assert main(["plot", "a.mcap", "-o", "a.pdf", "--panels", wrong]) == 2
        told = capsys.readouterr().err
        assert f"{said}; allowed: trajectories, references, margin" in told and told.count("\n") == 1


def among_things():
    """A team that walks two metres along x, a wall beside it, a box that drives off, and a wall far away."""
    world = {
        "walls": (
            {"start": (-3.0, 0.9), "end": (3.0, 0.9), "thickness": 0.1},
            {"start": (-3.0, 90.0), "end": (3.0, 90.0), "thickness": 0.1},
        ),
        "moving_boxes": (
            {
                "size": (0.3, 0.3),
                "waypoints": ({"time": 0.0, "center": (0.0, -0.6)}, {"time": 2.0, "center": (2.5, -0.6)}),
            },
        ),
    }
    plan = scenario(plant="physics", world=world, estimator={})
    return run(plan, ticks={"hand_true": resting(plan).hand_true})


def test_the_plan_shows_what_stands_and_moves_near_the_team_and_not_what_is_far():
    from pbrg_mj.analysis.figures.trajectories import trajectories

    made = among_things()
    axes = drawn(trajectories, made)
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    q = made.ticks.hand_true
    assert left < q[..., 0].min() and right > q[..., 0].max()
    assert q[..., 1].max() < 0.95 < top < 5.0
    assert bottom < -0.75


def test_the_plan_shows_the_wall_that_held_a_robot_and_names_its_line():
    """Two robots at x = 1 are held by a wall at 3.6, farther than what stands near: the line for hand points too."""
    from pbrg_mj.analysis.figures.trajectories import trajectories

    wall = {"from": (3.65, -2.0), "to": (3.65, 1.0), "thickness": 0.1}
    plan = scenario(plant="physics", world={"walls": (wall,)}, estimator={})
    multipliers = np.zeros((21, 2, 2))
    for held in (False, True):
        multipliers[-1, 0, 0] = 0.3 * held
        made = run(plan, ticks={"half_space_h": np.full((21, 2, 1), 3.5), "multipliers": multipliers})
        axes = drawn(trajectories, made)
        named = [text.get_text() for text in axes.get_legend().get_texts()]
        assert (axes.get_xlim()[1] > 3.7) == held == ("line for hand points" in named)


def test_a_moving_box_that_stays_far_away_is_not_in_the_legend():
    from pbrg_mj.analysis.figures.trajectories import trajectories

    box = {"size": (0.3, 0.3), "waypoints": ({"time": 0.0, "center": (9.0, 9.0)},)}
    axes = drawn(trajectories, run(scenario(plant="physics", world={"moving_boxes": (box,)}, estimator={})))
    assert axes.get_ylim()[1] < 5 and len(axes.get_legend().get_texts()) == 2  # r, best admissible


def test_a_moving_box_is_drawn_where_it_came_nearest_to_a_robot():
    from pbrg_mj.analysis.figures.trajectories import trajectories

    made = among_things()
    axes = drawn(trajectories, made)
    (box,) = [patch for patch in axes.patches if patch.get_label() == "moving box where nearest"]
    low, high = box.get_xy().min(axis=0), box.get_xy().max(axis=0)
    middles = [np.array([1.25 * min(t, 2.0), -0.6]) for t in made.ticks.time]
    away = [
        np.linalg.norm(np.maximum(np.abs(q - middle) - 0.15, 0.0), axis=1).min()
        for q, middle in zip(made.ticks.hand_true, middles, strict=True)
    ]
    np.testing.assert_allclose((low + high) / 2, middles[int(np.argmin(away))], atol=1e-9)
    np.testing.assert_allclose(high - low, 0.3)
    assert "moving box where nearest" in [text.get_text() for text in axes.get_legend().get_texts()]


def test_what_is_not_finite_is_near_no_moving_box():
    from pbrg_mj.analysis.metrics.obstacles import closest_approach

    (box,) = among_things().scenario.world.moving_boxes
    time = np.array([0.0, 1.0, 2.0])
    points = np.array([[[np.nan, 0.0]], [[1.3, -0.6]], [[np.nan, np.nan]]])
    np.testing.assert_allclose(closest_approach(box, time, points), [1.25, -0.6])
    assert np.isfinite(closest_approach(box, time, np.full((3, 1, 2), np.nan))).all()


def test_the_line_that_hand_points_keep_from_has_one_name_in_the_legend():
    from pbrg_mj.analysis.figures.trajectories import trajectories

    line = {"robot": 1, "normal": (1.0, 0.0), "offset": 2.0}
    for given in ((line,), (line, {**line, "normal": (0.0, 1.0)}), ()):
        plan = scenario(estimator={"source": "given", "given": given})
        axes = drawn(trajectories, run(plan))
        dashed = [one for one in axes.lines if one.get_label() == "line for hand points"]
        assert [one.get_linestyle() for one in dashed] == ["--"] * bool(given)
        legend = axes.get_legend()
        assert legend is not None
        names = [text.get_text() for text in legend.get_texts()]
        assert names.count("line for hand points") == bool(given) and "r" in names


@pytest.mark.parametrize("largest", [1e-2, np.inf])
def test_neither_rounding_nor_divergence_sets_the_scale_of_consensus(largest):
    from pbrg_mj.analysis.figures.time_histories import consensus

    spread = np.geomspace(1e-4, 1e-2, 21)
    spread[0], spread[-1] = 0.0, largest
    low, high = drawn(consensus, run(ticks={"consensus_spread": spread})).get_ylim()
    assert 1e-5 < low <= spread[1]
    assert spread[-2] <= high < 1e-1
