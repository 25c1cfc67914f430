"""A study's process is killed alone at a random moment: those that make its runs end, and the same command goes on.

All of them hold the pipe of its stderr open; that it ends says that nobody is left. This is for a process that has
made no runs in others itself: a fork has its resource tracker, which removes what is left when all of them are gone.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import shutil
import signal
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pbrg_mj.cli.main import main
from scripts.fuzz.sandbox import run_apart
from scripts.fuzz.verdict import Failure, fault

FILE, OUTPUT, TEMPORARY, JOURNAL = "study.yaml", "out", "tmp", "runs.jsonl"
JOBS = 2
LONGEST = 0.3  # [s] from the line of the journal that is waited for to the kill
STARTING = (
    6.0  # [s] from the study's start to the kill where no line is waited for: processes begin, or make first runs
)
PATIENCE = 120.0  # [s] for that line
GONE = 60.0  # [s] within which nobody may be left; who has got no run yet waits for one for 20 s
RUNS = "duration: 2\nset: {plant: ideal, reference.solver: none, timing.tick: 0.02}\n"
SWEEP = f"scenario: paper/simulation_near\nseeds: 1-8\nlogs: true\n{RUNS}"
TUNE = f"""\
scenario: paper/simulation_near
seeds: 1-2
held_out: 3
keys: {{control.alpha_r: {{log_uniform: [0.2, 3]}}}}
budget: 4
batch_size: 2
{RUNS}"""
SEARCH = f"find: crossing\nkeys: {{control.alpha_r: {{uniform: [0.5, 3]}}}}\nbatch_size: 3\n{RUNS}"
SUITE = f"""\
description: Two governors
scenario: [paper/simulation_near]
train: 1
held_out: 2-4
governors:
  none: {{settings: {{governor.kind: none}}, tuning: nothing to tune}}
  paper: {{settings: {{governor.kind: distributed}}, tuning: nothing to tune}}
networks: {{perfect: {{}}}}
quick: {{scenario: [paper/simulation_near], train: 1, held_out: 2, governors: [none], networks: [perfect]}}
{RUNS}"""
STUDIES: dict[str, tuple[str, tuple[str, ...]]] = {  # by command: the study's file, and the arguments
    "sweep": (SWEEP, (FILE,)),
    "tune": (TUNE, (FILE,)),
    "falsify": (SEARCH, ("paper/simulation_near", "--search", FILE, "--budget", "9")),
    "bench": (SUITE, (FILE,)),
}
TIMED = ("timings.parquet", "wall_clock.md", "index.html", JOURNAL)  # hold wall clocks, or the order in which runs came
_whole: dict[str, dict[str, bytes]] = {}  # what is in the folder of a study that nobody killed


def warm_up() -> None:
    """Make every study once, undisturbed: what it makes then is what it makes after any kill."""
    import joblib  # noqa: F401 - so that studies have it when they begin

    for command, (text, _) in STUDIES.items():
        Path(FILE).write_text(text)
        main(_command(command, jobs=1))
        _whole[command] = _made()
        _remove()


def attack(seed: int, codes: Counter[str]) -> Iterator[Failure]:
    """Kill the study of that number in the current folder, empty before and after; yield what went wrong."""
    rng = np.random.default_rng((18, seed))
    command = list(STUDIES)[seed % len(STUDIES)]
    runs = len(json.loads(_whole[command]["runs"]))
    finished = int(rng.integers(runs))
    after = float(rng.uniform(0.0, LONGEST if finished else STARTING))
    said = f"pbrg {' '.join(_command(command, JOBS))} # killed alone {after:.2f} s after {finished} of {runs} runs"
    Path(FILE).write_text(STUDIES[command][0])
    Path(TEMPORARY).mkdir()
    killed, left = _run_and_kill(command, finished, after)
    codes[f"{command} {'killed' if killed else 'over before'}"] += 1
    if left:
        yield Failure(seed, "left behind", said, "; ".join(left))
    before = _journal()
    ending = run_apart(lambda: main(_command(command, jobs=1)))
    codes[f"{command} again {ending.code}"] += 1
    found = fault(ending) if not ending.stderr.startswith("written: ") else None
    if found or ending.code not in (0, 1):
        yield Failure(seed, "did not go on", said, f"{found}; exit {ending.code}; {ending.stderr[-300:]}")
    elif _journal()[: len(before)] != before:
        yield Failure(seed, "finished runs are not as they were", said, f"{len(before)} of them")
    elif (made := _made()) != _whole[command]:
        other = sorted(k for k in {*made, *_whole[command]} if made.get(k) != _whole[command].get(k))
        yield Failure(seed, "another result", said, ", ".join(other))
    _remove()


def _command(command: str, jobs: int) -> list[str]:
    return [command, *STUDIES[command][1], "-o", OUTPUT, "--jobs", str(jobs)]


def _run_and_kill(command: str, finished: int, after: float) -> tuple[bool, list[str]]:
    """Kill the study's process; return whether it was still there, and what it left."""
    end, stderr = os.pipe()
    child = os.fork()
    if not child:
        _be_the_study(command, stderr)
    os.close(stderr)
    deadline = time.monotonic() + PATIENCE
    while len(_journal()) < finished and not _is_over(child) and time.monotonic() < deadline:
        time.sleep(0.005)
    time.sleep(after)
    killed = not _is_over(child)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    left = [] if _ends(end) else [f"processes, {GONE:g} s later"]
    os.close(end)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    places = [*Path(TEMPORARY).rglob("*"), *_of_process(child)]
    return killed, left + [str(one) for one in places]


def _be_the_study(command: str, stderr: int) -> None:
    """Run the study, with a folder of its own for temporary files."""
    with contextlib.suppress(BaseException):
        os.setsid()
        os.dup2(stderr, 2)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os.environ["TMPDIR"] = str(Path(TEMPORARY).resolve())
        tempfile.tempdir = None
        main(_command(command, JOBS))
    os._exit(0)


def _is_over(child: int) -> bool:
    return os.waitid(os.P_PID, child, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None


def _ends(pipe: int) -> bool:
    """Return whether everybody lets go of the pipe in time."""
    deadline = time.monotonic() + GONE
    while (left := deadline - time.monotonic()) > 0:
        if select.select([pipe], [], [], left)[0] and not os.read(pipe, 2**16):
            return True
    return False


def _of_process(number: int) -> list[Path]:
    """Return what a process keeps in memory that others share."""
    return [one for sign in "-_" for one in Path("/dev/shm").glob(f"*{sign}{number}{sign}*")]


def _journal() -> list[bytes]:
    """Return the lines of finished runs that are whole."""
    file = Path(OUTPUT) / JOURNAL
    lines = file.read_bytes().splitlines(keepends=True)[1:] if file.exists() else []
    return [line for line in lines if line.endswith(b"\n")]


def _made() -> dict[str, bytes]:
    """Return what the study wrote, apart from what holds wall clocks, and the numbers of the runs in its journal."""
    files = [one for one in Path(OUTPUT).rglob("*") if one.is_file() and one.name not in TIMED]
    made = {str(one): b"" if one.suffix == ".mcap" else one.read_bytes() for one in files}
    return made | {"runs": json.dumps(sorted(json.loads(line)["run"] for line in _journal())).encode()}


def _remove() -> None:
    for one in Path.cwd().iterdir():
        shutil.rmtree(one) if one.is_dir() else one.unlink()
