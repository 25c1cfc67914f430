"""However a command fails, it says so in one line and an exit code of its own."""

from __future__ import annotations

import errno
import os
import resource
import signal
import subprocess
import sys
import threading
import warnings
from pathlib import Path

import pytest

from pbrg_mj.cli.main import main
from pbrg_mj.errors import PlugInError
from pbrg_mj.video import worker
from scripts.fuzz.sandbox import run_apart
from tests.test_cli import IDEAL, ROOT

LARGEST = 600  # bytes of a file on a full disk


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("ideal.yaml").write_text(IDEAL)
    return tmp_path


@pytest.fixture
def failing(monkeypatch):
    """Let `pbrg list` fail."""

    def fail_with(action):
        monkeypatch.setattr("pbrg_mj.list_scenarios", action, raising=False)

    return fail_with


def raising(error):
    def fail():
        raise error

    return fail


class Unspeakable(Exception):
    def __str__(self):
        raise ValueError


@pytest.mark.parametrize(
    ("error", "code", "says"),
    [
        (ValueError("the sun\nwent down"), 3, "error: ValueError: the sun went down (scenarios.py:"),
        (RecursionError("too deep"), 3, "error: RecursionError: too deep"),
        (KeyError("x" * 10_000), 3, "error: KeyError: 'xxx"),
        (SystemExit(0), 3, "error: SystemExit: 0"),
        (GeneratorExit(), 3, "error: GeneratorExit (scenarios.py:"),
        (Unspeakable(), 3, "error: Unspeakable (scenarios.py:"),
        (OSError("a pipe without a name"), 3, "error: OSError: a pipe without a name"),
        (OSError(28, "No space left on device", "a.png"), 1, "error: a.png: No space left on device\n"),
        (OSError(13, "Permission denied", "a.png"), 2, "error: a.png: Permission denied\n"),
        (MemoryError(), 1, "error: out of memory"),
        (PlugInError("mine: the governor raised"), 1, "error: mine: the governor raised\n"),
    ],
)
def test_any_failure_is_one_line_and_an_exit_code(failing, capsys, error, code, says):
    failing(raising(error))
    assert main(["list"]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(says)
    assert err.count("\n") == 1
    assert len(err) < 600


@pytest.mark.parametrize("arguments", [["--debug", "list"], ["list", "--debug"]])
def test_the_traceback_stands_before_the_line_with_debug(failing, capsys, arguments):
    failing(raising(ValueError("here")))
    assert main(arguments) == 3
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "Traceback (most recent call last):"
    assert any("in fail" in line for line in lines)
    assert lines[-1].startswith("error: ValueError: here")


def test_wrong_input_has_a_traceback_with_debug_only(capsys):
    assert main(["run", "no/such", "--debug"]) == 2
    assert "Traceback" in capsys.readouterr().err
    assert main(["run", "no/such"]) == 2
    assert "Traceback" not in capsys.readouterr().err


def test_debug_behind_two_dashes_is_a_name(capsys):
    assert main(["show", "--", "--debug"]) == 2
    assert capsys.readouterr().err.startswith("error: '--debug' is neither")


def test_a_thread_that_fails_is_one_line_and_exit_code_3(failing, capsys):
    def start():
        thread = threading.Thread(target=raising(ValueError("in a thread")))
        thread.start()
        thread.join()
        return []

    failing(start)
    assert main(["list"]) == 3
    err = capsys.readouterr().err
    assert err.startswith("error: ValueError: in a thread")
    assert err.count("\n") == 1


# As numba words it when a variable of the environment has a value that it cannot read.
UNREAD = """\
Environment variable 'NUMBA_OPT' is defined but its associated value 'nine' could not be parsed.
The parse failed with exception:
Traceback (most recent call last):
  File "config.py", line 183, in _readenv
    return ctor(value)
           ^^^^^^^^^^^
ValueError: unsupported value 'nine'
"""
READ = (
    "warning: Environment variable 'NUMBA_OPT' is defined but its associated value 'nine' could not be parsed. "
    "The parse failed with exception: ValueError: unsupported value 'nine'"
)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("overflow\nsomewhere", "warning: overflow somewhere"),
        (UNREAD, READ),
        ("x" * 10_000, "warning: " + "x" * 397 + "..."),
    ],
)
def test_a_warning_of_python_is_one_line(failing, capsys, text, says):
    def warn():
        with warnings.catch_warnings():
            warnings.simplefilter("default")
            warnings.showwarning = sys.modules["warnings"].showwarning
            warnings.warn(text, RuntimeWarning, stacklevel=1)
        return []

    failing(warn)
    assert main(["list"]) == 0
    assert capsys.readouterr().err == says + "\n"
    assert main(["list", "--debug"]) == 0
    *whole, last = capsys.readouterr().err.splitlines()
    assert last.startswith(says + " (") and whole == (text.splitlines() if "\n" in text else [])


def test_hooks_are_put_back(failing):
    before = threading.excepthook, sys.unraisablehook, warnings.showwarning
    failing(raising(ValueError()))
    main(["list"])
    assert (threading.excepthook, sys.unraisablehook, warnings.showwarning) == before


def test_the_drawing_process_hands_its_traceback_over(tmp_path):
    class Ended:
        def wait(self):
            return 1

    (tmp_path / "errors").write_bytes(b"Traceback (most recent call last):\n  File x\nValueError: no picture\n")
    with (tmp_path / "errors").open("rb") as errors:
        failure = worker._failure(Ended(), errors)
    assert str(failure) == "in the drawing process: ValueError: no picture"
    assert failure.__notes__[0].startswith("Traceback")


def pbrg(command, **options):
    """Run it in a shell, where `pbrg` is the command."""
    line = command.replace("pbrg", f"{sys.executable} -m pbrg_mj", 1)
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        ["bash", "-c", line], capture_output=True, text=True, env=environment, check=False, timeout=120, **options
    )
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("what", ["list", "--version", "--help"])
def test_a_reader_that_is_gone_ends_it_as_unix_tools_end(what):
    """By SIGPIPE's exit code and without a word."""
    assert pbrg(f"pbrg {what} | true; exit ${{PIPESTATUS[0]}}") == (141, "", "")


@pytest.mark.parametrize(
    ("to", "says"),
    [
        (">&-", "error: cannot write to standard output: it is closed\n"),
        (">/dev/full", "error: cannot write to standard output: No space left on device\n"),
    ],
)
def test_a_stdout_that_takes_nothing_is_one_line(to, says):
    assert pbrg(f"pbrg list {to}") == (1, "", says)


@pytest.mark.parametrize("to", ["2>&-", "2>/dev/full", ">&- 2>&-", "<&- >&- 2>&-"])
def test_a_stderr_that_takes_nothing_changes_no_exit_code(to):
    assert pbrg(f"pbrg validate no/such {to}") == (2, "", "")


def test_a_closed_stdout_is_not_written_into_the_log(folder):
    """The file opened next would have its number, and get all that a library prints."""
    assert pbrg("pbrg run ideal.yaml --quiet -o a.mcap <&- >&- 2>&-")[0] == 0
    assert pbrg("pbrg run ideal.yaml --quiet -o b.mcap --set log.timings=false")[0] == 0
    assert pbrg("pbrg replay a.mcap --verify")[0] == 0


@pytest.mark.parametrize(
    "command",
    ["run ideal.yaml -o pipe.mcap", "schema -o pipe.json", "new pipe.yaml --force", "batch ideal.yaml -o pipe.npz"],
)
@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_an_output_that_is_no_file_is_refused_and_stays(folder, command, kind):
    place = Path(next(word for word in command.split() if word.startswith("pipe")))
    if kind == "pipe":
        os.mkfifo(place)
    else:
        place.symlink_to("/dev/null")
    code, _, err = pbrg(f"pbrg {command}")
    assert (code, err) == (2, f"error: {place}: is a pipe or a device; allowed: a new name, or a file to replace\n")
    assert not place.is_file()


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    made = tmp_path_factory.mktemp("log") / "ideal.mcap"
    (made.parent / "ideal.yaml").write_text(IDEAL)
    assert main(["run", str(made.parent / "ideal.yaml"), "--quiet", "-o", str(made)]) == 0
    return str(made)


STUDY = "scenario: ideal.yaml\nduration: 0.1\nset: {reference.solver: none}\n"
PARTS = ("none", "cbf")
GOVERNORS = ", ".join(f"{one}: {{settings: {{governor.kind: {one}}}, tuning: none}}" for one in PARTS)
STUDIES = {
    "sweep.yaml": STUDY + "seeds: 1-4\n",
    "tune.yaml": STUDY + "seeds: 1\nkeys: {control.alpha_r: {uniform: [0.5, 1.5]}}\nbudget: 3\n",
    "space.yaml": "find: crossing\nduration: 0.1\nkeys: {control.alpha_r: {uniform: [0.5, 1.5]}}\n",
    "suite.yaml": f"scenario: [ideal.yaml]\ntrain: 1\nheld_out: 2-3\nduration: 0.1\ngovernors: {{{GOVERNORS}}}\n",
}


@pytest.mark.parametrize(
    ("command", "name"),
    [
        *((f"plot LOG -o a.{kind}", f"a.{kind}") for kind in ("pdf", "png", "svg")),
        *((f"export LOG -o a.{kind}", f"a.{kind}") for kind in ("csv", "npz", "mat")),
        ("report LOG -o a.html", "a.html"),
        ("repair LOG -o a.mcap", "a.mcap"),
        ("schema -o a.json", "a.json"),
        ("schema --datagrams -o a.proto", "a.proto"),
        ("new a.yaml", "a.yaml"),
        ("draw families/combined --seed 2 -o a.yaml", "a.yaml"),
        ("batch ideal.yaml --seeds 1-40 -o a.npz", "a.npz"),
        ("run ideal.yaml --quiet -o a.mcap", "a.mcap"),
        ("sweep sweep.yaml -o out --jobs 1", "out/runs.jsonl"),
        ("tune tune.yaml -o out --jobs 1", "out/runs.jsonl"),
        ("falsify ideal.yaml --search space.yaml --budget 4 -o out --jobs 1", "out/runs.jsonl"),
        ("bench suite.yaml -o out --jobs 1", "run.mcap"),
    ],
)
def test_a_disk_that_is_full_while_a_file_is_written_is_one_line(folder, log, command, name):
    """Writers of other packages fail in ways of their own, some of them again while they close the file."""
    for file, text in STUDIES.items():
        Path(file).write_text(text)
    before = {*folder.iterdir()}

    def limited():  # as far as a process can have a full disk: files may not grow
        resource.setrlimit(resource.RLIMIT_FSIZE, (LARGEST, LARGEST))
        return main([log if word == "LOG" else word for word in command.split()])

    ending = run_apart(limited)
    assert ending.code == 1, ending.stderr
    assert name in ending.stderr and "File too large" in ending.stderr
    assert ending.stderr.startswith("error: ") and ending.stderr.count("\n") == 1
    assert {*folder.iterdir()} - before <= {folder / "out"}


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
def test_a_full_disk_is_no_wrong_input(folder, monkeypatch, capsys, number):
    def fail(*_, **__):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("tempfile.mkstemp", fail)
    assert main(["schema", "-o", "a.json"]) == 1
    assert capsys.readouterr().err == f"error: a.json: cannot write here: {os.strerror(number)}\n"


def test_ctrl_c_while_it_starts_leaves_no_traceback(folder):
    """The module that everything comes with is replaced by one that waits to be interrupted."""
    code = (
        "import sys, _thread, importlib.abc\n"
        "class Slow(importlib.abc.MetaPathFinder):\n"
        "    def find_spec(self, name, path, target=None):\n"
        "        if name == 'typer':\n"
        "            _thread.interrupt_main()\n"
        "sys.meta_path.insert(0, Slow())\n"
        "from pbrg_mj.__main__ import main\n"
        "sys.exit(main())\n"
    )
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False)
    assert (done.returncode, done.stderr) == (130, "")


def test_a_pipe_that_nobody_writes_into_is_an_empty_file(folder):
    os.mkfifo("pipe.yaml")
    assert pbrg("pbrg validate pipe.yaml") == (2, "", "error: pipe.yaml:1: is empty; allowed: a scenario in YAML\n")


def test_a_pipe_with_a_writer_is_read(folder):
    code, out, _ = pbrg("pbrg validate <(sleep 0.2; cat ideal.yaml)")
    assert (code, out.partition(":")[2]) == (0, " ok, 2 robots, ideal plant, 0.5 s\n")


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_a_signal_s_exit_code_is_its_own(number, code, monkeypatch, capsys):
    """Of any command, also where none of its parts says what is there."""
    monkeypatch.setattr("pbrg_mj.cli.scenarios.emit", lambda *_: signal.raise_signal(number))
    assert main(["list"]) == code
    assert capsys.readouterr() == ("", "")
