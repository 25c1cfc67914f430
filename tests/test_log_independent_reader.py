"""A reader of others, @mcap/core with protobufjs on node, decodes every message of every channel."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pbrg_mj.log.read.run import open_run
from pbrg_mj.log.write.writer import LogWriter
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from tests.node_packages import installed_scripts, printed

TICKS = 101


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    scripts = installed_scripts(tmp_path_factory.mktemp("node"))
    log = tmp_path_factory.mktemp("log") / "log.mcap"
    loaded = load_scenario("paper/experiment_near", ["timing.duration=1"])
    simulation = Simulation.build(loaded.scenario)
    with LogWriter(log, loaded, simulation.model_xml) as write:
        for record in simulation.records():
            write(record)
    return log, printed(scripts / "read_log.cjs", log)


def test_every_channel_is_decoded_to_its_last_message(found: tuple[Path, dict[str, Any]]) -> None:
    counts = {topic: one["count"] for topic, one in found[1].items() if topic != "/events"}
    drawings = 11
    scans = {topic: counts.pop(topic) for topic in list(counts) if topic.startswith("/scan/")}
    assert set(scans) == {"/scan/robot_5"} and scans["/scan/robot_5"] >= 10
    assert 30 <= counts.pop("/tf") <= 32
    assert counts == {
        "/tick": TICKS,
        "/timing": TICKS,
        "/optimum": 11,
        "/scene": 1,
        "/scene/team": drawings,
        "/poses/p": drawings,
        "/poses/m": drawings,
    }


def test_values_are_those_that_python_reads(found: tuple[Path, dict[str, Any]]) -> None:
    log, channels = found
    run = open_run(log)
    last = channels["/tick"]["last"]
    for name in ("m", "multipliers", "body_pose_true", "half_space_h", "half_space_active", "command"):
        assert last[name] == getattr(run.ticks, name)[-1].ravel().tolist(), name
    assert (last["status"], int(last["index"])) == ("ok", TICKS - 1)
    assert channels["/optimum"]["last"]["m"] == run.optima.m[-1].tolist()
    assert [pose["position"]["x"] for pose in channels["/poses/p"]["last"]["poses"]] == run.ticks.p[-1, :, 0].tolist()


def test_the_scene_shows_where_things_are(found: tuple[Path, dict[str, Any]]) -> None:
    log, channels = found
    run = open_run(log)
    plan = {entity["id"]: entity for entity in channels["/scene"]["last"]["entities"]}
    assert [plan[f"robot_{k}"]["frame_locked"] for k in range(1, 6)] == [True] * 5
    team = {entity["id"]: entity for entity in channels["/scene/team"]["last"]["entities"]}
    lines = team["half_spaces"]["lines"]
    assert len(lines) == np.count_nonzero(run.ticks.half_space_active[-1].any(axis=1))
    robot = int(np.argmax(run.ticks.half_space_active[-1].any(axis=1)))
    G, h = run.ticks.half_space_G[-1, robot, 0], run.ticks.half_space_h[-1, robot, 0]
    for point in lines[0]["points"][:2]:
        assert G @ [point["x"], point["y"]] == pytest.approx(h, abs=1e-12)
    balls = [(ball["pose"]["position"]["x"], ball["pose"]["position"]["y"]) for ball in team["references"]["spheres"]]
    expected = [*run.ticks.m[-1], run.ticks.reference[-1], run.optima.m[-1]]
    assert balls == [tuple(point.tolist()) for point in expected]
