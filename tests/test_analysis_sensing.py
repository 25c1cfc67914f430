"""The optimum on the true walls beside the one on sensed half-spaces."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pbrg_mj.analysis.metrics.run_metrics import metrics
from pbrg_mj.analysis.metrics.sensing_gap import TrueOptimum
from pbrg_mj.cli.main import main
from pbrg_mj.log.read.run import open_run


@pytest.fixture(scope="module")
def ideal(tmp_path_factory):
    path = tmp_path_factory.mktemp("sensing") / "x.mcap"
    assert main(["run", "paper/simulation_inadmissible", "--duration", "10", "--quiet", "-o", str(path)]) == 0
    return open_run(path)


def test_exact_half_spaces_leave_no_gap(ideal):
    assert metrics(ideal).sensing_gap_m.p95 < 1e-4


@pytest.mark.parametrize("governor", ["{certificate: directional_ball}", "{kind: certified}"])
def test_nor_do_they_with_another_certificate(governor, tmp_path):
    path = tmp_path / "x.mcap"
    arguments = ["paper/simulation_inadmissible", "--duration", "4", "--set", f"governor={governor}", "-o", str(path)]
    assert main(["run", *arguments, "--quiet"]) == 0
    assert metrics(open_run(path)).sensing_gap_m.p95 < 2e-3  # the prediction's rows are made about the held m


def test_a_wall_five_centimetres_off_moves_the_optimum(ideal):
    """The line the leader was given stays; the true wall, and with it m*_true, moves 5 cm nearer."""
    walls = ideal.scenario.world.walls
    shift = -0.05 / np.sqrt(2)
    moved = [
        wall.model_copy(
            update={
                "start": (wall.start[0] + shift, wall.start[1] + shift),
                "end": (wall.end[0] + shift, wall.end[1] + shift),
            }
        )
        for wall in walls
    ]
    world = ideal.scenario.world.model_copy(update={"walls": tuple(moved)})
    estimator = ideal.scenario.estimator.model_copy(update={"source": "beams", "given": ()})
    scenario = ideal.scenario.model_copy(update={"world": world, "estimator": estimator})
    nearer = dataclasses.replace(ideal, scenario=scenario)
    rows = np.searchsorted(ideal.ticks.index, ideal.optima.index)
    p, xi, reference = (values[rows] for values in (ideal.ticks.p, ideal.ticks.xi, ideal.ticks.reference))
    true = TrueOptimum(nearer.scenario).solve(p, xi, reference, np.zeros((len(rows), 2)))
    assert true is not None
    normal = np.array([1.0, 1.0]) / np.sqrt(2)
    back = (ideal.optima.m - true) @ normal
    assert np.all(back > 0.0)
    assert metrics(nearer).sensing_gap_m.mean == pytest.approx(np.linalg.norm(ideal.optima.m - true, axis=1).mean())
    # the ball's boundary is a cone: the optimum moves back by no more than the wall does
    assert np.all(back <= 0.05 + 1e-6)


def test_with_own_scopes_there_is_nothing_to_compare(ideal):
    estimator = ideal.scenario.estimator.model_copy(update={"scope": "own"})
    own = dataclasses.replace(ideal, scenario=ideal.scenario.model_copy(update={"estimator": estimator}))
    assert metrics(own).as_dict()["sensing_gap_m"] == {"mean": None, "p95": None, "final": None}
