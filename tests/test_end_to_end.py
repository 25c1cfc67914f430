"""The main job as a user runs it: a bundled scenario in, a log out, and what must be true of it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from mcap.reader import make_reader

from pbrg_mj.cli.main import main
from pbrg_mj.log.read.run import open_run

EXPERIMENTS = ("paper/experiment_near", "paper/experiment_inadmissible")


def pbrg(*arguments: str) -> int:
    return main(list(arguments))


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """One log per physics experiment of the paper, 60 simulated seconds."""
    folder = tmp_path_factory.mktemp("experiments")
    paths = {name: folder / f"{name.split('/')[-1]}.mcap" for name in EXPERIMENTS}
    for name, path in paths.items():
        assert pbrg("run", name, "--duration", "60", "--quiet", "-o", str(path)) == 0
    return paths


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_no_robot_touches_the_wall_and_every_reference_tick_has_its_gap(name, logs):
    run = open_run(logs[name])
    assert run.damage is None
    assert run.ticks.time[-1] == pytest.approx(60.0)
    assert not run.ticks.wall_contact.any()
    beyond = run.ticks.hand_true @ np.array([1.0, 1.0]) / np.sqrt(2) - 3.0 / np.sqrt(2)
    assert beyond.max() < 0.0  # every hand point stays behind the true line x + y = 3
    np.testing.assert_allclose(run.ticks.wall_margin.min(), -beyond.max(), atol=1e-4)
    assert len(run.optima.time) == 601
    assert set(run.optima.status) == {"solved"}
    at = np.searchsorted(run.ticks.index, run.optima.index)
    gap = np.linalg.norm(run.ticks.m[at] - run.optima.m[:, None], axis=2)
    assert np.isfinite(gap).all()
    assert gap[-100:].max() < 0.02  # once the team is slow, the network has caught up with the optimum


def test_the_sensed_half_space_is_the_papers_line(logs):
    """Perception on: the leader's fit of x + y = 3, from noisy beams, within centimetres at every tick."""
    run = open_run(logs["paper/experiment_near"])
    active = run.ticks.half_space_active
    assert active[:, 4].sum(axis=1).min() == active[:, 4].sum(axis=1).max() == 1
    assert not active[:, :4].any()
    G = run.ticks.half_space_G[active]
    assert np.rad2deg(np.arccos(np.clip(G @ np.array([1.0, 1.0]) / np.sqrt(2), -1, 1))).max() < 2.0
    p = run.ticks.hand_true[:, 4]  # offsets compared where the leader is
    sensed = run.ticks.half_space_h[active] - np.einsum("tc,tc->t", G, p)
    true = 3.0 / np.sqrt(2) - p @ np.array([1.0, 1.0]) / np.sqrt(2)
    assert np.abs(sensed - true).max() < 0.03


def test_outcomes_are_told(logs, capsys):
    assert pbrg("compare", str(logs["paper/experiment_near"]), "--json") == 0
    # Wheels stick some centimetres short, and noise shakes them loose: with the seed's, that is either of these.
    near = json.loads(capsys.readouterr().out)[0]
    assert near["outcome"] in {"closing in", "stuck"}
    assert 0.02 < near["terminal_gap_m"] < 0.1
    assert pbrg("compare", str(logs["paper/experiment_inadmissible"]), "--json") == 0
    # still creeping towards the wall, ever slower, as the certificate's ball shrinks
    found = json.loads(capsys.readouterr().out)[0]
    assert found["outcome"] == "closing in"
    assert any("half-space 0.71 x + 0.71 y <= 2.1" in one and "(walls.0)" in one for one in found["binding"])
    assert any(one.startswith("the ball holds m") for one in found["binding"])


def messages(path):
    with path.open("rb") as stream:
        return [
            (channel.topic, message.log_time, message.data)
            for _, channel, message in make_reader(stream).iter_messages()
            if channel.topic != "/timing"
        ]


def test_same_seed_same_bytes_another_seed_another_log(tmp_path):
    paths = [tmp_path / f"{k}.mcap" for k in range(4)]
    off = ["--set", "log.timings=false"]
    for path, extra in zip(paths, ([], [], off, off), strict=True):
        assert pbrg("run", EXPERIMENTS[0], "--duration", "4", "--quiet", "-o", str(path), *extra) == 0
    assert messages(paths[0]) == messages(paths[1])
    assert paths[2].read_bytes() == paths[3].read_bytes()
    other = tmp_path / "other.mcap"
    assert pbrg("run", EXPERIMENTS[0], "--duration", "4", "--seed", "2", "--quiet", "-o", str(other)) == 0
    assert messages(other) != messages(paths[0])


@pytest.mark.parametrize("robots", [1, 3, 12])
def test_any_number_of_robots(robots, tmp_path, capsys):
    columns = range(robots)
    scenario = tmp_path / "team.yaml"
    scenario.write_text(
        json.dumps(
            {
                "timing": {"duration": 2.0},
                "team": {
                    "start": [[0.4 * (k % 4), 0.4 * (k // 4)] for k in columns],
                    "formation": [[0.3 * (k % 4), 0.3 * (k // 4)] for k in columns],
                    "leaders": [robots],
                },
                "world": {"walls": [{"from": [3.0, -2.0], "to": [3.0, 3.0]}]},
                "operator": {"reference": [1.0, 0.0]},
            }
        )
    )
    log = tmp_path / "team.mcap"
    assert pbrg("run", str(scenario), "--json", "-o", str(log)) == 0
    assert json.loads(capsys.readouterr().out)
    run = open_run(log)
    assert run.ticks.m.shape == (201, robots, 2)
    assert run.ticks.half_space_active.any(axis=2)[-1].any()  # somebody sees the wall
    assert np.isfinite(run.ticks.m).all()
