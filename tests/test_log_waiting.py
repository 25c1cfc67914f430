"""Records wait for their chunk before they are written: what that must not change."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import pytest

from pbrg_mj.log.read.run import open_run
from pbrg_mj.log.write import writer
from pbrg_mj.log.write.log_file import partial_path
from pbrg_mj.log.write.messages import MessageStream
from pbrg_mj.log.write.writer import LogWriter
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from tests.records import loaded, records

TICKS = 60


@pytest.mark.parametrize(
    ("scenario", "overrides"),
    [
        ("paper/experiment_near", ["sensors.beams.robots=all", "reference.period=0.01"]),
        ("paper/simulation_near", []),
        ("network/lossy", []),
        ("obstacles/moving_box", []),
    ],
)
def test_records_stay_what_they_were(scenario: str, overrides: list[str]) -> None:
    plan = load_scenario(scenario, overrides).scenario
    ticks, at_once = [], []
    stream = None
    for record in islice(Simulation.build(plan).records(), TICKS):
        stream = stream or MessageStream(plan, record)
        ticks.append(record)
        at_once.append(stream.messages(record))
    later = MessageStream(plan, ticks[0])
    assert [later.messages(record) for record in ticks] == at_once


def ticks_on_disk(path: Path) -> int:
    return len(open_run(path if path.exists() else partial_path(path)).ticks.time)


def test_whole_chunks_are_on_the_disk_while_a_run_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    found = []
    with LogWriter(path, loaded(timings=True), "<mujoco/>") as sink:
        for record in records(35):
            sink(record)
            if record.index >= 9:
                found.append(ticks_on_disk(path))
    assert found == [10] * 10 + [20] * 10 + [30] * 6
    assert ticks_on_disk(path) == 35


def test_ticks_that_fill_a_chunk_do_not_wait(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log.mcap"
    monkeypatch.setattr(writer, "CHUNK_BYTES", 1600)  # two ticks; the first, with the floor plan, is as large as two
    found = []
    with LogWriter(path, loaded(timings=True), "<mujoco/>") as sink:
        for record in records(5):
            sink(record)
            found.append(ticks_on_disk(path))
    assert found == [1, 1, 3, 3, 5]
