"""Every bundled scenario is valid, says what it shows, stands on its page, and runs."""

from __future__ import annotations

import re
from itertools import combinations, islice
from pathlib import Path

import numpy as np
import pytest

from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.bundled import bundled_scenarios
from pbrg_mj.scenario.load import load_scenario

PAGE = Path(__file__).resolve().parents[1] / "docs" / "scenarios.md"
NAMES = tuple(bundled_scenarios())
LEAST_SPACING = 0.3  # [m] between hand points of a formation: two bodies and a body's width between them
TOP_SPEED = 1.0  # [m/s] of the unloaded motors: the way of one second


def page_rows() -> dict[str, list[str]]:
    """The cells of the page's table of outcomes by scenario."""
    table = re.search(r"<!-- outcomes -->(.*?)<!-- end of outcomes -->", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert table is not None
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table[1].splitlines() if "| `" in line]
    return {row[0].strip("`"): row[1:] for row in rows}


def test_the_suite_is_as_large_as_the_page_says():
    assert len([name for name in NAMES if not name.startswith("paper/")]) >= 12
    assert tuple(page_rows()) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_one_sentence_says_what_it_shows(name):
    description = load_scenario(name).scenario.description
    assert 30 <= len(description) <= 120
    assert description[0].isupper()
    assert not re.search(r"[.!?](\s|$)", description)
    assert page_rows()[name][0] == description


@pytest.mark.parametrize("name", NAMES)
def test_robots_of_a_formation_keep_apart(name):
    formation = load_scenario(name).scenario.team.formation
    assert min(np.linalg.norm(np.subtract(a, b)) for a, b in combinations(formation, 2)) >= LEAST_SPACING - 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_one_second_of_it_runs_and_is_finite(name):
    scenario = load_scenario(name).scenario
    ticks = round(1.0 / scenario.timing.tick)
    records = list(islice(Simulation.build(scenario).records(), ticks + 1))
    assert len(records) == ticks + 1
    for record in records:
        problem, truth = record.problem, record.truth
        for values in (problem.p, problem.xi, record.solution.m, record.solution.multipliers, record.velocity):
            assert np.isfinite(values).all()
        assert np.isfinite(record.command).all()
        assert np.isfinite(truth.body_pose).all()
        assert not truth.wall_contact.any()
    moved = np.linalg.norm(records[-1].truth.hand_world - records[0].truth.hand_world, axis=1)
    # Somebody moves; nobody outruns the motors, which the ideal plant does not have.
    assert 0.001 < moved.max() < (TOP_SPEED if scenario.plant == "physics" else np.inf)
    assert any(record.optimum is not None for record in records)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_in_full_nobody_touches_anything_unless_the_page_says_so(name):
    simulation = Simulation.build(load_scenario(name).scenario)
    touched = np.zeros(simulation.loop.network.robots, dtype=bool)
    for _ in simulation.control_ticks():  # the closed loop alone: nothing that the monitor evaluates acts on it
        truth = simulation.loop.world.truth()
        touched |= truth.wall_contact | truth.moving_contact | truth.robot_contact
    assert bool(touched.any()) == (page_rows()[name][2] != "none")
