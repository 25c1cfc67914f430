"""MuJoCo's warnings become log messages, and no file appears."""

from __future__ import annotations

import logging

import numpy as np

from pbrg_mj.cli.main import main
from pbrg_mj.world.plant.physics import MujocoPlant
from tests.worlds import scenario

PUSH = {
    "robot": 1,
    "time": 0.0,
    "duration": 1.0,
    "force": (1e6, 0.0),
}


def test_an_unstable_simulation_is_told_once_per_world_and_writes_no_file(tmp_path, monkeypatch, caplog):
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        world = MujocoPlant(scenario(disturbances={"pushes": [PUSH] * 20}))
        for _ in range(20):
            world.advance(np.zeros((1, 2)))
    assert [record.levelno for record in caplog.records] == [logging.WARNING] * 2
    assert all("The simulation is unstable" in record.getMessage() for record in caplog.records)
    assert not any("\n" in record.getMessage() for record in caplog.records)
    assert not list(tmp_path.iterdir())


def test_the_command_line_tells_it_in_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    push = "disturbances.pushes=[" + ",".join(["{robot: 1, time: 0.0, duration: 1.0, force: [1e6, 0]}"] * 20) + "]"
    arguments = ["run", "paper/experiment_near", "--duration", "0.3", "--quiet", "--set", push]
    assert main(arguments) == 1
    told = capsys.readouterr().err
    assert told.startswith("warning: MuJoCo: ") and told.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["experiment_near.mcap"]
