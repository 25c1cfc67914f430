"""Damaged logs: what a repair keeps, and that no command that reads logs ever shows a traceback."""

from __future__ import annotations

import gc
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from pbrg_mj.cli.main import main
from pbrg_mj.errors import InputError
from pbrg_mj.log import repair as repair_module
from pbrg_mj.log.read.mcap_records import MAGIC, RECORD_PREFIX
from pbrg_mj.log.read.run import open_run
from pbrg_mj.log.repair import repair
from pbrg_mj.log.write.writer import LogWriter
from tests.records import SCENARIO_YAML, TICK, loaded, records
from tests.test_log_damage import FACTS, corrupt, forge, ticks_of

CHUNK = 6  # MCAP's opcode
SUFFIXES = {"export": (".npz", ".csv", ".mat"), "plot": (".svg",), "report": (".html",)}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Sixty ticks in six chunks."""
    path = tmp_path_factory.mktemp("log") / "whole.mcap"
    with LogWriter(path, loaded(timings=True), "<mujoco/>") as write:
        for record in records(60):
            write(record)
    return path.read_bytes()


def chunks(data: bytes) -> list[tuple[int, int]]:
    """Return start and end of each chunk's body."""
    found, at = [], len(MAGIC)
    while at + RECORD_PREFIX.size < len(data) - len(MAGIC):
        opcode, length = RECORD_PREFIX.unpack_from(data, at)
        at += RECORD_PREFIX.size
        if opcode == CHUNK:
            found.append((at, at + length))
        at += length
    return found


def hurt(data: bytes, *numbers: int) -> bytes:
    """The file with a bit changed in the compressed data of these chunks."""
    for number in numbers:
        _, end = chunks(data)[number]
        data = data[: end - 9] + bytes([data[end - 9] ^ 4]) + data[end - 8 :]
    return data


def repaired(folder: Path, data: bytes):
    (folder / "damaged.mcap").write_bytes(data)
    return repair(folder / "damaged.mcap", folder / "clean.mcap"), folder / "clean.mcap"


def ticks(path: Path) -> list[int]:
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        return [round(message.log_time / 1e9 / TICK) for _, _, message in reader.iter_messages(topics="/tick")]


def test_a_whole_log_becomes_its_own_copy(whole: bytes, tmp_path: Path) -> None:
    found, clean = repaired(tmp_path, whole)
    assert clean.read_bytes() == whole
    assert (found.damage, found.chunks, found.lost, found.ticks) == ([], 6, 0, [(0, 59)])


def test_a_cut_log_becomes_the_log_of_its_whole_chunks(whole: bytes, tmp_path: Path) -> None:
    for number, (start, end) in enumerate(chunks(whole)[1:], start=1):
        found, clean = repaired(tmp_path, whole[: (start + end) // 2])
        run = open_run(clean)
        assert (run.damage, len(run.ticks.time), found.chunks) == (None, 10 * number, number)
        assert found.damage == ["the file ends inside a record"]
        cut = open_run(tmp_path / "damaged.mcap")
        for name in ("m", "multipliers", "status", "hand_true"):
            assert getattr(run.ticks, name).tobytes() == getattr(cut.ticks, name).tobytes()
        assert (run.scenario_yaml, run.model_xml, run.versions) == (cut.scenario_yaml, cut.model_xml, cut.versions)


def test_whole_chunks_behind_a_damaged_one_are_kept(whole: bytes, tmp_path: Path) -> None:
    found, clean = repaired(tmp_path, hurt(whole, 2))
    assert (found.chunks, found.lost, found.ticks, found.kept_ticks) == (5, 1, [(0, 19), (30, 59)], 50)
    assert ticks(clean) == [*range(20), *range(30, 60)]
    run = open_run(clean)
    assert (len(run.ticks.time), run.damage) == (20, "message 20 on /tick is out of order")


def test_without_its_first_chunk_a_log_s_index_tells_the_channels(whole: bytes, tmp_path: Path) -> None:
    found, clean = repaired(tmp_path, hurt(whole, 0))
    assert (found.chunks, found.lost, found.ticks) == (5, 1, [(10, 59)])
    assert ticks(clean) == [*range(10, 60)]
    with clean.open("rb") as file:
        names = {channel.topic: schema.name for schema, channel, _ in make_reader(file).iter_messages()}
    assert names["/tick"] == "pbrg.Tick" and names["/scan/robot_3"] == "foxglove.LaserScan"


def test_repeated_chunks_are_left_out(whole: bytes, tmp_path: Path) -> None:
    start, end = chunks(whole)[3]
    again = whole[start - RECORD_PREFIX.size : end]
    found, clean = repaired(tmp_path, whole[:end] + again + whole[end:])
    assert (found.lost, found.ticks) == (1, [(0, 59)])
    assert found.damage[0] == "a chunk repeats earlier ticks"
    assert clean.read_bytes() == whole


def test_what_cannot_be_repaired_is_one_line(whole: bytes, tmp_path: Path, capfd) -> None:
    lost_everything = hurt(whole, 0)[: chunks(whole)[5][1]]  # neither first chunk nor index
    cases = {
        "holds no whole tick": lost_everything,
        "not an MCAP file": b"time,x,y\n",
        "is empty": b"",
        "not a log of pbrg": forge(tmp_path / "other.mcap", [], None).read_bytes(),
    }
    for said, data in cases.items():
        with pytest.raises(InputError, match=said) as caught:
            repaired(tmp_path, data)
        assert "\n" not in str(caught.value)
    gc.collect()
    assert capfd.readouterr().err == ""  # the compiled writer complains of files that are closed too early


def test_a_log_that_contradicts_itself_is_refused_before_its_ticks_are_read(tmp_path: Path, monkeypatch) -> None:
    path = forge(tmp_path / "forged.mcap", ticks_of(50), FACTS | {"robots": "0", "slots": "0", "rows": "0"})
    monkeypatch.setattr(repair_module, "_tick_index", lambda data: pytest.fail("a tick was read"))
    with pytest.raises(InputError, match="the log contradicts itself: 0 robots"):
        repair(path, tmp_path / "clean.mcap")


def test_ticks_beyond_the_scenarios_end_are_not_read(whole: bytes, tmp_path: Path, monkeypatch) -> None:
    read, text = [], SCENARIO_YAML.replace("TIMINGS", "true").replace("{tick: 0.02}", "{tick: 0.02, duration: 0.06}")
    monkeypatch.setattr(repair_module, "_tick_index", read.append)
    path = forge(tmp_path / "forged.mcap", ticks_of(50), scenario=text)
    with pytest.raises(InputError, match="a chunk has ticks beyond the scenario's end"):
        repair(path, tmp_path / "clean.mcap")
    assert read == []


def test_the_command_never_overwrites_its_input(whole: bytes, tmp_path: Path, capsys) -> None:
    log = tmp_path / "log.mcap"
    log.write_bytes(whole[:-99])
    (tmp_path / "link.mcap").symlink_to(log)
    for name in ("log.mcap", "link.mcap", "clean.txt"):
        assert main(["repair", str(log), "-o", str(tmp_path / name)]) == 2
        assert capsys.readouterr().err.count("\n") == 1
    assert log.read_bytes() == whole[:-99]
    assert main(["repair", str(log), "-o", str(tmp_path / "clean.mcap")]) == 0
    captured = capsys.readouterr()
    assert captured.err == f"warning: {log}: the index at the file's end is cut\n"
    assert "60 ticks in 6 chunks" in captured.out
    assert (tmp_path / "clean.mcap").read_bytes() == whole
    (tmp_path / "text.mcap").write_text("no log")
    assert main(["repair", str(tmp_path / "text.mcap"), "-o", str(tmp_path / "new.mcap")]) == 2
    assert not (tmp_path / "new.mcap").exists()


def test_cut_logs_say_so_in_one_line(whole: bytes, tmp_path: Path, capsys) -> None:
    log = tmp_path / "cut.mcap"
    log.write_bytes(whole[: len(whole) * 2 // 3])
    for arguments in commands(log, tmp_path):
        assert main(arguments) in (0, 1), arguments
        assert capsys.readouterr().err == f"warning: {log}: the file ends inside a record\n", arguments


def commands(log: Path, folder: Path) -> list[list[str]]:
    """Every command that reads a log and can be had without a display."""
    return [
        ["compare", str(log)],
        ["compare", str(log), "--json"],
        ["replay", str(log)],
        ["replay", str(log), "--verify"],
        ["repair", str(log), "--force", "-o", str(folder / "out.mcap")],
        *(
            [name, str(log), "-o", str(folder / f"out{suffix}")]
            for name, suffixes in SUFFIXES.items()
            for suffix in suffixes
        ),
    ]


@pytest.mark.filterwarnings("default::RuntimeWarning")  # the records are noise: NaN, infinities
def test_random_accidents_give_no_traceback_in_any_command(whole: bytes, tmp_path: Path, capsys) -> None:
    rng = np.random.default_rng(1)
    log = tmp_path / "accident.mcap"
    codes = []
    for turn in range(45):
        log.write_bytes(corrupt(whole, rng))
        choice = commands(log, tmp_path)
        arguments = choice[turn % len(choice)]
        codes.append(main(arguments))  # any exception fails the test
        errors = capsys.readouterr().err
        assert "Traceback" not in errors
        assert codes[-1] != 2 or (errors.startswith("error: ") and errors.count("\n") == 1), (turn, errors)
    assert set(codes) == {0, 1, 2}  # 1: noise does not repeat
