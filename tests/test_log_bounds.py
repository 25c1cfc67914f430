"""Reading takes memory for what a log holds, not for what it declares; metrics take less than the run."""

from __future__ import annotations

import gc
import os
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.analysis.export import export
from pbrg_mj.analysis.figures.figure import plot, wanted_panels
from pbrg_mj.analysis.metrics import samples
from pbrg_mj.analysis.metrics.log_metrics import log_metrics
from pbrg_mj.analysis.metrics.run_metrics import metrics
from pbrg_mj.analysis.reduced_run import open_reduced
from pbrg_mj.analysis.replay_summary import replay_summary
from pbrg_mj.analysis.report.report_run import report_log, report_run
from pbrg_mj.api import simulate
from pbrg_mj.api.logs import plot_log, replay_log
from pbrg_mj.cli.main import main
from pbrg_mj.errors import InputError
from pbrg_mj.log.read import columns, mcap_records
from pbrg_mj.log.read.column_store import Columns
from pbrg_mj.log.read.columns import BLOCK_MESSAGES, MessageColumns
from pbrg_mj.log.read.header import open_mcap
from pbrg_mj.log.read.layout import MOST_TEXT, Layout
from pbrg_mj.log.read.mcap_records import MAGIC, RECORD_PREFIX
from pbrg_mj.log.read.run import open_run
from pbrg_mj.log.read.ticks import LoggedTicks
from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.fields import MESSAGES
from pbrg_mj.log.schema.protobuf import CLASSES, encoder
from pbrg_mj.log.write.mcap_writer import McapWriter
from pbrg_mj.log.write.writer import LogWriter
from tests.records import SCENARIO_YAML, loaded, records
from tests.test_log_damage import DIMS, FACTS, forge, ticks_of

MOST_PER_TICK = 2048  # bytes


def written(path: Path, ticks: int) -> Path:
    with LogWriter(path, loaded(timings=True), "<mujoco/>") as sink:
        for record in records(ticks):
            sink(record)
    return path


def test_reading_costs_at_most_two_kilobytes_a_tick(tmp_path: Path) -> None:
    few, many = (written(tmp_path / f"{ticks}.mcap", ticks) for ticks in (300, 1500))

    def peak(path: Path) -> int:
        tracemalloc.start()
        run = open_run(path)
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert run.damage is None
        return found

    peak(few)  # what is made once, as classes are
    assert (peak(many) - peak(few)) / 1200 < MOST_PER_TICK


def test_a_short_log_is_read_in_little_memory(tmp_path: Path) -> None:
    path = written(tmp_path / "run.mcap", 20)
    open_run(path)
    tracemalloc.start()
    open_run(path)
    assert tracemalloc.get_traced_memory()[1] < 2e6
    tracemalloc.stop()


def test_a_block_of_columns_has_a_bound_in_bytes_however_large_the_team(tmp_path: Path, monkeypatch) -> None:
    path, lengths = written(tmp_path / "run.mcap", 300), []
    whole = open_run(path)
    monkeypatch.setattr(columns, "BLOCK_BYTES", 10_000)

    def look(block: Columns) -> Columns:
        lengths.append(sum(values.nbytes for values in block.values()))
        return block

    found = open_run(path, {"Tick": look})
    assert found.ticks.multipliers.tobytes() == whole.ticks.multipliers.tobytes()
    assert len(lengths) > 10 and max(lengths) < 15_000


def agree(found: Any, expected: Any) -> None:
    """All numbers and words are the same, but for the rounding of sums."""
    if isinstance(expected, dict):
        assert found.keys() == expected.keys()
        for name in expected:
            agree(found[name], expected[name])
    else:
        assert found == (pytest.approx(expected, rel=1e-12, abs=1e-15) if isinstance(expected, float) else expected)


def test_memory_for_metrics_does_not_grow_with_the_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both logs fill all that is held: the window of the trend (1250 ticks), and what percentiles keep in memory.

    Long enough that a chunk of the file is once read when the window is fullest, which is the peak.
    """
    monkeypatch.setattr(samples, "MOST_HELD", 256)
    lengths = 20 * BLOCK_MESSAGES, 60 * BLOCK_MESSAGES
    few, many = (written(tmp_path / f"{ticks}.mcap", ticks) for ticks in lengths)

    def peak(path: Path) -> int:
        gc.collect()
        tracemalloc.start()
        log_metrics(path)
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    peak(few)  # what is made once
    assert (peak(many) - peak(few)) / (lengths[1] - lengths[0]) < 8  # not even a number a tick


def test_a_run_holds_no_more_the_longer_it_takes(tmp_path: Path) -> None:
    held: list[int] = []

    def look(tick: pbrg.TickRecord) -> None:
        if tick.index % 500 == 0:
            gc.collect()
            held.append(tracemalloc.get_traced_memory()[0])

    plan = pbrg.load("paper/simulation_near", duration=20.0)
    tracemalloc.start()
    simulate.record(plan, tmp_path / "long.mcap", watch=[look])
    tracemalloc.stop()
    assert len(held) == 5
    # Chunks of the log come and go; a tick's record has some 5000 bytes.
    assert (max(held[3:]) - max(held[1:3])) / 1000 < 1000


@pytest.mark.parametrize("scenario", ["paper/experiment_near", "paper/simulation_inadmissible"])
def test_metrics_of_a_log_are_those_of_the_run(tmp_path: Path, scenario: str) -> None:
    path = tmp_path / "run.mcap"
    assert main(["run", scenario, "--duration", "6", "--quiet", "-o", str(path)]) == 0
    run = open_run(path)
    assert len(run.ticks.time) > 2 * BLOCK_MESSAGES
    agree(log_metrics(path).as_dict(), metrics(run).as_dict())


BLOCKED = """\
timing: {duration: 9.0}
team: {start: [[0.0, 0.0]], formation: [[0.0, 0.0]], leaders: [1]}
graph: {kind: ring}
world: {boxes: [{center: [1.0, 0.0], size: [0.4, 4.0]}]}
estimator: {source: points, scope: own}
governor: {kind: cbf}
reference: {solver: none}
operator: {reference: [1.0, 0.0]}
"""


def test_a_log_of_a_team_that_rests_before_a_box_without_a_target_has_the_outcome_of_its_run(tmp_path: Path) -> None:
    (tmp_path / "blocked.yaml").write_text(BLOCKED)
    path = tmp_path / "run.mcap"
    assert main(["run", str(tmp_path / "blocked.yaml"), "--quiet", "-o", str(path)]) == 0
    found = log_metrics(path)
    assert found.outcome == "stuck" and np.isnan(found.target_x_m)
    agree(found.as_dict(), metrics(open_run(path)).as_dict())


@pytest.mark.parametrize("source", ["noise", "paper/experiment_near"])
def test_events_pages_and_pictures_of_a_log_are_those_of_the_run(tmp_path: Path, source: str) -> None:
    path = tmp_path / "log.mcap"
    if source == "noise":
        written(path, BLOCK_MESSAGES + 40)
    else:
        assert main(["run", source, "--duration", "3", "--quiet", "-o", str(path)]) == 0
    run = open_run(path)
    assert replay_log(path).as_dict() == replay_summary(run).as_dict()
    shown, expected = report_log(path, 1), report_run(run, 1)
    assert shown.animation == expected.animation
    agree(shown.numbers.as_dict(), expected.numbers.as_dict())
    plot_log(path, tmp_path / "log.svg", "all")
    plot(run, tmp_path / "run.svg", wanted_panels("all"))
    assert (tmp_path / "log.svg").read_bytes() == (tmp_path / "run.svg").read_bytes()


@pytest.mark.parametrize("show", [replay_log, lambda path: report_log(path, 1), lambda path: open_reduced(path)])
def test_showing_costs_less_than_two_kilobytes_a_tick(tmp_path: Path, show: Callable[[Path], object]) -> None:
    few, many = (written(tmp_path / f"{ticks}.mcap", ticks) for ticks in (1600, 3000))  # a page has 1500 frames

    def peak(path: Path) -> int:
        tracemalloc.start()
        show(path)
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    peak(few)
    assert (peak(many) - peak(few)) / 1400 < MOST_PER_TICK


def test_a_table_of_text_is_written_some_ticks_at_a_time(tmp_path: Path) -> None:
    run = open_run(written(tmp_path / "log.mcap", 3000))
    tracemalloc.start()
    export(run, tmp_path / "log.csv")
    found = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found / 3000 < MOST_PER_TICK / 2  # 5.4 kB, were all of them objects at once
    assert (tmp_path / "log.csv").read_text(encoding="utf-8").count("\n") == 3001


@pytest.mark.parametrize("ticks", [1, 20, BLOCK_MESSAGES + 40])
def test_metrics_of_noise_are_those_of_noise(tmp_path: Path, ticks: int) -> None:
    """Contacts, infinities, all statuses; optima at every tenth tick, as the scenario has them, or not."""
    path = written(tmp_path / "log.mcap", ticks)
    expected = metrics(open_run(path)).as_dict()
    agree(log_metrics(path).as_dict(), expected)
    assert expected["reference_ticks"] == 1 + (ticks - 1) // 10


def test_a_column_that_was_not_kept_is_not_there(tmp_path: Path) -> None:
    path = written(tmp_path / "log.mcap", 20)
    kept = {"Tick": lambda columns: {"time": columns["time"], "twice": 2 * columns["p"]}}
    run = open_run(path, kept)
    np.testing.assert_array_equal(run.ticks.time, 0.02 * np.arange(20))
    assert run.reduced["twice"].shape == (20, 3, 2)
    with pytest.raises(AttributeError):
        _ = run.ticks.p


def test_a_log_has_no_more_ticks_than_its_scenario(tmp_path: Path) -> None:
    text = SCENARIO_YAML.replace("TIMINGS", "true").replace("{tick: 0.02}", "{tick: 0.02, duration: 0.06}")
    run = open_run(forge(tmp_path / "long.mcap", ticks_of(9), scenario=text))
    assert (len(run.ticks.time), run.damage) == (4, "message 4 on /tick is beyond the scenario's end")


def test_a_hole_that_calls_itself_a_record_is_not_read(tmp_path: Path) -> None:
    path, size = tmp_path / "hole.mcap", 60 * 2**30
    with path.open("wb") as file:
        file.write(MAGIC + RECORD_PREFIX.pack(0x42, size))
        file.truncate(len(MAGIC) + RECORD_PREFIX.size + size)
    with pytest.raises(InputError, match="a record has an impossible size"):
        open_run(path)
    assert main(["repair", str(path), "-o", str(tmp_path / "out.mcap")]) == 2
    os.truncate(path, 0)


def test_a_text_of_a_forger_does_not_fill_every_row(tmp_path: Path) -> None:
    first, second, third = (CLASSES["Tick"].FromString(data) for data in ticks_of(3))
    second.status, third.status = "x" * MOST_TEXT, "x" * (MOST_TEXT + 1)  # type: ignore[attr-defined]
    run = open_run(forge(tmp_path / "log.mcap", [one.SerializeToString() for one in (first, second, third)]))
    assert (len(run.ticks.time), run.damage) == (2, "message 2 on /tick cannot be read")


def test_a_tick_of_countless_messages_is_refused(tmp_path: Path) -> None:
    path, said = forge(tmp_path / "log.mcap", ticks_of(1) * 1000), "more than 80 messages at 0 s"
    with open_mcap(path) as (file, size), pytest.raises(InputError, match=said):
        list(LoggedTicks(file, size, "log.mcap"))


def test_countless_other_messages_are_not_waited_for(tmp_path: Path, monkeypatch) -> None:
    path, tick = tmp_path / "log.mcap", ticks_of(1)[0]
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.add_attachment(0, 0, channels.SCENARIO_ATTACHMENT, "", loaded(timings=True).yaml_text.encode())
        writer.add_metadata(channels.RUN_METADATA, FACTS)
        add_tick = writer.add_channel(channels.TICK, "pbrg.Tick", b"")
        add_other = writer.add_channel(channels.EVENTS, "foxglove.Log", b"")
        add_tick(tick, log_time=0)
        for time in range(1000):
            add_other(b"", log_time=time)
        writer.finish()
    run = open_run(path)
    assert (len(run.ticks.time), run.damage) == (1, "more than 80 messages belong to one tick")
    monkeypatch.setattr(mcap_records, "MOST_IN_CHUNK", 500)
    assert main(["repair", str(path), "-o", str(tmp_path / "out.mcap")]) == 2
    with path.open("rb") as file, pytest.raises(mcap_records.DamageError, match="a chunk holds more than 500 records"):
        file.seek(len(MAGIC))
        list(mcap_records.read_records(file, path.stat().st_size))


@pytest.mark.parametrize("name", MESSAGES)
def test_messages_of_others_read_the_same(name: str) -> None:
    """Protobuf's own runtime orders fields otherwise, and leaves out zeros."""
    ours, theirs = MessageColumns(name, DIMS), MessageColumns(name, DIMS)
    for record in (one for one in records(BLOCK_MESSAGES + 30) if name != "Optimum" or one.optimum is not None):
        data = encoder(name, DIMS)(record)
        again = CLASSES[name].FromString(data).SerializeToString()
        assert ours.add(data, 0, 10**9) == theirs.add(again, 0, 10**9) == record.index
    mine, other = ours.columns(), theirs.columns()
    assert list(mine) == [field.name for field in MESSAGES[name]]
    for field in MESSAGES[name]:
        assert mine[field.name].tobytes() == other[field.name].tobytes(), field.name


def test_what_is_no_message_is_refused() -> None:
    good = ticks_of(1)[0]
    layout = Layout.of("Tick", good, DIMS)
    assert layout.fits(good)
    flag = layout.offsets["wall_contact"]
    for bad in (
        good + good,  # every field twice
        good[:-1],
        good[:flag] + b"\x02" + good[flag + 1 :],
        b"\x0b" + good,  # a group's start
        b"\x00" + good,  # field 0
        b"\xff" * 11 + good,
    ):
        with pytest.raises(ValueError, match=r"."):
            Layout.of("Tick", bad, DIMS)
        assert len(bad) != len(good) or not layout.fits(bad)
    later = good + b"\xfa\x3f\x03abc" + b"\xf9\x3f" + bytes(8)  # fields 1023 of a later version
    assert Layout.of("Tick", later, DIMS).offsets == layout.offsets


def test_a_tick_has_one_message_of_a_kind() -> None:
    columns = MessageColumns("Tick", DIMS)
    first, second, third = ticks_of(3)
    assert columns.add(first, 0, 0) == 0
    for data, place in ((first, 1), (third, 1)):
        with pytest.raises(IndexError):
            columns.add(data, place, place)
    assert columns.add(second, 1, 1) == 1 and columns.count == 2
