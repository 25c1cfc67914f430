"""Warnings before a run, and its outcome when it is started all the same."""

from __future__ import annotations

import json

from pbrg_mj.cli.main import main
from pbrg_mj.governor.stability.proximal_step import proximal_step_bound
from pbrg_mj.loop.stability_warnings import stability_warnings, step_bound
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.team.graph import network


def paper(*overrides):
    return load_scenario("paper/experiment_near", overrides).scenario


def test_the_papers_steps_raise_no_doubt():
    assert stability_warnings(paper()) == []
    assert stability_warnings(paper("governor.kind=centralized", "governor.rounds=1")) == []


def test_a_step_beyond_the_limit_of_linear_modes_is_predicted_with_that_limit():
    (line,) = stability_warnings(paper("governor.step=0.05"))
    assert line.startswith(
        "a round of 0.05 s may be too long for alpha = 7 on this graph: its linear modes alone are stable"
    )
    (line,) = stability_warnings(paper("governor.rounds=1"))
    assert "a round of 0.01 s" in line


def test_proximal_rounds_have_a_bound_of_their_own():
    proximal = "governor.integration=proximal"
    assert stability_warnings(paper(proximal, "governor.step=0.05")) == []
    (line,) = stability_warnings(paper(proximal, "governor.step=0.12"))
    assert "proximal rounds are proved to converge up to" in line


def test_delays_past_the_margin_are_predicted_and_waves_bear_them():
    assert stability_warnings(paper("network.delay_rounds=300")) == []
    (line,) = stability_warnings(paper("network.delay_rounds=800"))
    assert line.startswith("messages 800 rounds late, 0.8 s, may be too late for alpha = 7 on this graph: the plain")
    assert "stable up to 394 rounds, 0.39 s. `network.exchange: scattering`" in line
    assert stability_warnings(paper("network.delay_rounds=800", "network.exchange=scattering")) == []
    links = "network.links=[{robots: [1, 2], delay_rounds: 1000}]"
    (line,) = stability_warnings(paper("network.delay_rounds=500", links))
    assert "s, the others in proportion. " in line


def test_input_rows_shorten_the_step_of_linear_modes():
    assert stability_warnings(paper("governor.step=0.005")) == []
    (line,) = stability_warnings(paper("governor.step=0.005", "control.speed_limit=0.8"))
    assert "a round of 0.005 s" in line


def test_the_run_warns_beforehand_and_says_diverged_afterwards(tmp_path, capsys):
    arguments = ["--set", "governor.step=0.5", "--duration", "8", "--json", "-o", str(tmp_path / "x.mcap")]
    assert main(["run", "paper/simulation_near", *arguments]) == 1
    printed = capsys.readouterr()
    assert "warning: a round of 0.5 s may be too long" in printed.err
    assert json.loads(printed.out)["outcome"] == "diverged"
    assert main(["validate", "paper/simulation_near"]) == 0
    assert "warning" not in capsys.readouterr().err


def test_what_bounds_a_round_is_told_by_its_name():
    explicit, proximal = step_bound(paper()), step_bound(paper("governor.integration=proximal"))
    assert "(explicit): linear modes alone are stable up to" in explicit
    assert explicit.endswith("no bound is proved for explicit rounds")
    assert "(proximal): proved to converge below" in proximal
    assert (
        step_bound(paper("governor.kind=centralized"))
        == "no rounds whose length is bounded (governor.kind: centralized)"
    )
    team = network(paper())
    bound = proximal_step_bound(team, 7.0, 5 * paper().estimator.half_spaces_per_robot)
    assert f"below {bound:.2g} s" in step_bound(paper("governor.integration=proximal", "governor.alpha=7.0"))
