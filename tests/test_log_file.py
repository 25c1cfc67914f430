"""One log, one run: temporary name, lock, and nothing overwritten unless that is asked for."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import pbrg_mj as pbrg
from pbrg_mj.api.interrupt import interruptible, stop, stoppable
from pbrg_mj.cli.main import main
from pbrg_mj.errors import InputError, PbrgError, Stopped
from pbrg_mj.log.read.run import open_run
from pbrg_mj.log.write.log_file import partial_path
from pbrg_mj.log.write.writer import LogWriter
from tests.records import loaded, records
from tests.runs import run, scenario

ROOT = Path(__file__).parents[1]
EARLIER = Path(__file__).parent / "data" / "version_0_1_0.mcap"


def write(path: Path, ticks: int = 20, *, force: bool = False) -> Path:
    with LogWriter(path, loaded(timings=False), "<mujoco/>", force=force) as sink:
        for record in records(ticks):
            sink(record)
    return path


def killed(path: Path) -> Path:
    """What a killed run leaves: the log's whole chunks, under the temporary name."""
    data = write(path).read_bytes()
    path.unlink()
    partial_path(path).write_bytes(data[: data.index(b"pbrg.ending")])
    return partial_path(path)


def test_a_log_has_its_name_when_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with LogWriter(path, loaded(timings=False), "<mujoco/>") as sink:
        for record in records(20):
            sink(record)
            assert [file.name for file in tmp_path.iterdir()] == ["log.mcap.part"]
    assert [file.name for file in tmp_path.iterdir()] == ["log.mcap"]


def test_two_runs_never_write_into_one_log(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    for force in (False, True):
        with LogWriter(path, loaded(timings=False), "<mujoco/>", force=force) as first:
            for number, record in enumerate(records(20)):
                if number in (0, 1, 15):
                    with pytest.raises(InputError, match=r"log\.mcap: another run is writing this log"):
                        write(path, force=True)
                first(record)
        assert path.read_bytes() == write(tmp_path / f"alone_{force}.mcap").read_bytes()
    assert open_run(path).damage is None


def test_two_commands_at_once_leave_one_whole_log(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "pbrg_mj.cli.main", "run", "paper/simulation_near", "-o", "one.mcap", "--quiet"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    both = [
        subprocess.Popen(
            [*command, "--duration", "20", "--seed", str(seed)],
            cwd=tmp_path,
            env=environment,
            stderr=subprocess.PIPE,
            text=True,
        )
        for seed in (1, 2)
    ]
    ends = [(process.communicate()[1], process.returncode) for process in both]
    assert sorted(code for _, code in ends) == [0, 2]
    said = next(text for text, code in ends if code == 2)
    assert said.count("\n") == 1 and ("another run" in said or "exists" in said)
    left = open_run(tmp_path / "one.mcap")
    assert (left.damage, left.ending_text) == (None, "finished")
    assert left.scenario.seed == 1 + [code for _, code in ends].index(0)


def test_an_existing_log_is_not_overwritten_without_force(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    log = Path("near.mcap")
    arguments = ["run", "paper/simulation_near", "--duration", "0.1", "--quiet", "-o", str(log)]
    assert main(arguments) == 0
    before = log.read_bytes()
    attempts: list[list[str]] = [
        [*arguments, "--seed", "2"],
        ["repair", str(log), "-o", "copy.mcap"],
        ["batch", "paper/experiment_near", "--duration", "0.1", "--seeds", "1", "-o", "seeds.npz"],
    ]
    Path("copy.mcap").write_bytes(b"mine")
    Path("seeds.npz").write_bytes(b"mine")
    for attempt in attempts:
        assert main(attempt) == 2
        said = capsys.readouterr().err
        assert "exists; --force" in said and said.count("\n") == 1
    with pytest.raises(InputError, match="exists"):
        pbrg.run("paper/simulation_near", log=log)
    with pytest.raises(InputError, match="exists"):
        pbrg.open(log).save("copy.mcap")
    assert log.read_bytes() == before
    assert Path("copy.mcap").read_bytes() == Path("seeds.npz").read_bytes() == b"mine"
    for attempt in attempts:
        assert main([*attempt, "--force"]) == 0
    assert log.read_bytes() != before and open_run(log).scenario.seed == 2
    assert Path("copy.mcap").read_bytes() == log.read_bytes()
    Path("copy.mcap").write_bytes(b"mine")
    pbrg.open(log).save("copy.mcap", force=True)
    assert Path("copy.mcap").read_bytes() == log.read_bytes()


def test_reproduce_overwrites_no_log_without_force(tmp_path: Path, capsys) -> None:
    pytest.importorskip("matplotlib")
    old = tmp_path / "experiment_near.mcap"
    old.write_bytes(b"mine")
    assert main(["reproduce", "-o", str(tmp_path), "--duration", "0.1"]) == 2
    assert "experiment_near.mcap: exists; --force" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == [old.name]
    assert main(["reproduce", "-o", str(tmp_path), "--duration", "0.1", "--force"]) == 0
    assert open_run(old).damage is None


def test_what_a_killed_run_left_is_kept_and_named(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    partial = killed(Path("log.mcap"))
    before = partial.read_bytes()
    with pytest.raises(
        InputError, match=r"holds what a killed run wrote; `pbrg repair .*log\.mcap\.part -o OUT\.mcap`"
    ):
        write(Path("log.mcap"))
    for command in ("replay", "compare"):
        assert main([command, "log.mcap"]) == 2
        said = capsys.readouterr().err
        assert "there is no such file; what a run that was killed, or goes on, has written is in log.mcap.part" in said
        assert "pbrg repair" in said and said.count("\n") == 1
    assert partial.read_bytes() == before
    assert main(["repair", "log.mcap.part", "-o", "log.mcap"]) == 0
    clean = open_run("log.mcap")
    assert (clean.damage, clean.ending_text) == (None, "not said (killed?)")
    assert len(clean.ticks.time) >= 10
    write(Path("log.mcap"), force=True)
    assert not partial.exists() and len(open_run("log.mcap").ticks.time) == 20


def test_what_appears_meanwhile_stays(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    said = r"has appeared meanwhile; the log stays in .*\.part"
    with pytest.raises(PbrgError, match=said), LogWriter(path, loaded(timings=False), "<mujoco/>") as sink:
        for record in records(20):
            sink(record)
        path.write_bytes(b"mine")
    assert path.read_bytes() == b"mine"
    assert open_run(partial_path(path)).damage is None


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    real, link = tmp_path / "there" / "log.mcap", tmp_path / "link.mcap"
    link.symlink_to(real)
    write(link)
    assert link.is_symlink() and open_run(real).damage is None
    with (
        LogWriter(real, loaded(timings=False), "<mujoco/>", force=True),
        pytest.raises(InputError, match="another run"),
    ):
        write(link, force=True)


@pytest.mark.parametrize("name", ["log.mcap", "log.mcap.part"])
def test_a_pipe_is_refused_at_once(tmp_path: Path, name: str) -> None:
    os.mkfifo(tmp_path / name)
    with pytest.raises(InputError, match="is a pipe or a device"):
        write(tmp_path / "log.mcap", force=True)


def test_a_log_says_how_much_it_holds_and_why_it_ends(tmp_path: Path) -> None:
    """The scenario asks for 100 s or 2001 ticks."""
    path = tmp_path / "log.mcap"

    def end(error: BaseException | None) -> str:
        try:
            with LogWriter(path, loaded(timings=False), "<mujoco/>", force=True) as sink:
                for record in records(20):
                    sink(record)
                if error:
                    raise error
        except BaseException as caught:
            assert caught is error
        return open_run(path).ending_text

    assert end(None) == "stopped"
    assert end(KeyboardInterrupt()) == "interrupted (SIGINT)"
    assert end(Stopped(signal=signal.SIGTERM)) == "interrupted (SIGTERM)"
    assert end(pbrg.PlugInError("my.Governor: step raised\nValueError")) == "error: my.Governor: step raised ValueError"
    assert end(ZeroDivisionError("division by zero")) == "error: ZeroDivisionError: division by zero"


class Raising:
    """A governor that raises at its 30th step."""

    def init(self, problem):
        return 0

    def step(self, problem, steps):
        if steps == 30:
            raise ValueError("out of ideas")
        return pbrg.Solution.of(problem, problem.p.mean(axis=0)), steps + 1


def test_a_governor_that_raises_leaves_a_log_that_says_so(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with pytest.raises(pbrg.PlugInError):
        pbrg.run(pbrg.load("paper/simulation_near", duration=1.0), Raising(), path)
    left = open_run(path)
    assert (left.damage, len(left.ticks.time)) == (None, 30)
    assert left.ending_text.startswith("error: ") and "out of ideas" in left.ending_text


def test_every_command_repeats_why_a_log_ends(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["run", "paper/simulation_near", "--duration", "0.5", "--quiet", "-o", "whole.mcap"]) == 0

    def press(record: pbrg.TickRecord) -> None:
        if record.index == 12:
            signal.raise_signal(signal.SIGTERM)

    with pytest.raises(pbrg.Interrupted) as caught:
        pbrg.run(pbrg.load("paper/simulation_near", duration=0.5), log="cut.mcap", watch=[press])
    assert caught.value.signal == signal.SIGTERM
    capsys.readouterr()
    assert main(["compare", "whole.mcap", "cut.mcap"]) == 0
    lines = [line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines()]
    assert [line[1].split(maxsplit=1) for line in lines if line[:1] == ["ended"]] == [
        ["finished", "interrupted (SIGTERM)"]
    ]
    assert main(["replay", "whole.mcap"]) == main(["replay", "cut.mcap"]) == 0
    said = capsys.readouterr().out
    assert "51 ticks, 0.5 of 0.5 s: finished\n" in said
    assert "13 ticks, 0.12 of 0.5 s: interrupted (SIGTERM)\n" in said
    assert main(["replay", "cut.mcap", "--verify"]) == 0
    assert capsys.readouterr().out.endswith("bit for bit; the log ends there: interrupted (SIGTERM)\n")
    assert main(["report", "whole.mcap", "cut.mcap", "-o", "both.html"]) == 0
    page = Path("both.html").read_text(encoding="utf-8")
    assert "0.5 of 0.5 s: finished" in page and "0.12 of 0.5 s: interrupted (SIGTERM)" in page


def test_an_earlier_log_says_nothing_and_a_planted_one_is_whole() -> None:
    assert open_run(EARLIER).ending is None
    assert run(scenario()).ending_text == "finished"


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGINT])
def test_a_signal_that_is_ignored_stays_ignored_and_sigterm_ends_it(number: signal.Signals) -> None:
    """As under nohup, and as in a job that a script starts in the background."""
    before = signal.signal(number, signal.SIG_IGN)
    try:
        with pytest.raises(Stopped) as caught, stoppable(), interruptible() as came:
            signal.raise_signal(number)
            assert came() == 0
            signal.raise_signal(signal.SIGTERM)
            raise Stopped(signal=came())
        assert caught.value.signal == signal.SIGTERM
        assert signal.getsignal(number) is signal.SIG_IGN
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    finally:
        signal.signal(number, before)


def test_a_program_that_handles_sigterm_goes_on_doing_so() -> None:
    seen: list[int] = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: seen.append(number))
    try:
        with interruptible() as came:
            signal.raise_signal(signal.SIGTERM)
        assert (seen, came()) == ([signal.SIGTERM], 0)
    finally:
        signal.signal(signal.SIGTERM, before)


def test_a_second_signal_ends_at_once() -> None:
    with pytest.raises(Stopped) as caught, stoppable(), interruptible() as came:
        signal.raise_signal(signal.SIGTERM)
        assert came() == signal.SIGTERM
        signal.raise_signal(signal.SIGHUP)
    assert caught.value.signal == signal.SIGHUP
    assert signal.getsignal(signal.SIGINT) is not stop
