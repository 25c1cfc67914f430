"""A sample of the attacks of docs/reliability.md, and what the attacks themselves must be."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.log.read.run import open_run
from pbrg_mj.plugins import IN_SCENARIOS
from pbrg_mj.scenario.load import parse_scenario
from pbrg_mj.studies.bench.suite import read_suite
from pbrg_mj.studies.document import read_study
from pbrg_mj.studies.sweep_plan import check_settings, plan
from pbrg_mj.studies.task import Source
from scripts.fuzz import kills, logs, scenarios, studies
from scripts.fuzz.forgeries import forgery
from scripts.fuzz.mcap import take_apart
from scripts.fuzz.mutants import mutant
from scripts.fuzz.sandbox import CPU, MEMORY, Ending, run_apart
from scripts.fuzz.study_mutants import STUDIES, study_mutant
from scripts.fuzz.verdict import fault

ROOT = Path(__file__).parents[1]
DATA = sorted((ROOT / "tests" / "data").glob("*.mcap"))
SAMPLES = {
    scenarios: 40,
    studies: 8,
    logs: 12,
    kills: 3,
}  # other cases than those that were looked at while this was written
FIRST = 10**6


@pytest.mark.parametrize("attack", SAMPLES, ids=lambda one: one.__name__.rsplit(".", 1)[-1])
def test_a_sample_of_attacks(attack, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    attack.warm_up()
    codes: Counter[str] = Counter()
    for seed in range(FIRST, FIRST + SAMPLES[attack]):
        assert list(attack.attack(seed, codes)) == []
    assert len(codes) >= 2


@pytest.mark.slow
def test_a_sample_of_killed_studies(tmp_path: Path) -> None:
    """In a process of its own: forks of one that made runs in others leave to its tracker what killed ones leave."""
    command = [
        sys.executable,
        "-m",
        "scripts.fuzz",
        "orphans",
        "--first",
        str(FIRST),
        "--cases",
        "4",
        "--keep",
        tmp_path,
    ]
    found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout + found.stderr
    assert found.stdout.startswith("4 cases, ") and found.stdout.endswith("; failures: none\n")
    assert "killed" in found.stdout


def test_mutants_are_their_seeds_and_some_are_valid() -> None:
    mutants = [mutant(seed) for seed in range(60)]
    assert mutants == [mutant(seed) for seed in range(60)]
    assert len({one.content for one in mutants if not one.overrides}) > 40
    valid = 0
    for one in mutants:
        try:
            parse_scenario(one.content.decode("utf-8", "replace"))
            valid += not one.overrides
        except InputError:
            pass
    assert 5 < valid < 40


def test_mutants_name_parts_that_the_schema_does_not_list() -> None:
    """Governors, certificates, estimators and solvers have open lists of names: ours are among the mutants."""
    said = b"".join(b" ".join([one.content, *map(str.encode, one.overrides)]) for one in map(mutant, range(1500)))
    names = {name for kind in IN_SCENARIOS for name in kind.built_in}
    assert {name for name in names if name.encode() not in said} == set()
    assert said.count(b"set_up=recommended") > 10


def test_mutants_of_studies_are_their_seeds_and_of_all_commands() -> None:
    made = [study_mutant(seed) for seed in range(60)]
    assert made == [study_mutant(seed) for seed in range(60)]
    assert {command[0] for one in made for command in one.commands} == {*STUDIES, "draw", "run", "batch"}
    assert len({one.content for one in made}) > 45


@pytest.mark.parametrize("command", STUDIES)
def test_the_files_that_mutants_of_studies_are_made_from_are_valid(command: str, tmp_path: Path) -> None:
    text, keys = STUDIES[command]
    (tmp_path / "study.yaml").write_text(text)
    file = read_study(tmp_path / "study.yaml", keys)
    if command == "sweep":
        assert len(plan(file)) == 16 * 2
    elif command == "bench":
        assert len(read_suite(file.path).tasks) == 2 * 2 * 2 * 3
    else:
        source = Source.of("families/columns", Path())
        entries = {("set", key): {key: one} for key, one in file.keys.set.items()}
        check_settings(file, source, 1, entries)


@pytest.mark.parametrize("path", DATA, ids=lambda path: path.stem)
def test_a_log_taken_apart_and_put_together_is_whole(path: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.mcap"
    again.write_bytes(take_apart(path.read_bytes()).bytes())
    assert open_run(again).damage is None
    assert len(open_run(again).ticks.time) == len(open_run(path).ticks.time)


def test_forgeries_are_their_seeds_and_most_have_the_right_checksums(tmp_path: Path) -> None:
    originals = [path.read_bytes() for path in DATA]
    forged = [forgery(seed, originals) for seed in range(40)]
    assert forged == [forgery(seed, originals) for seed in range(40)]
    said = []
    for content in forged:
        (tmp_path / "forged.mcap").write_bytes(content)
        try:
            said.append(open_run(tmp_path / "forged.mcap").damage or "")
        except InputError as error:
            said.append(str(error))
    assert sum("checksum" in text for text in said) < 10


def used(**changes) -> Ending:
    return Ending(
        **({"code": 0, "signal": None, "cpu_s": 1.0, "memory_bytes": 2**28, "stdout": "", "stderr": ""} | changes)
    )


@pytest.mark.parametrize(
    ("ending", "kind"),
    [
        (used(), None),
        (used(code=2, stderr="error: no\n"), None),
        (used(code=0, stderr="warning: a\nwarning: b\n"), None),
        (used(code=2, stderr="error: no\nerror: no\n"), "lines that begin with error"),
        (used(code=2), "lines that begin with error"),
        (used(code=0, stderr="RuntimeWarning: overflow\n"), "stray line on stderr"),
        (used(code=3, stderr="error: a defect\n"), "exit 3"),
        (used(code=None, signal=signal.SIGSEGV), "signal 11"),
        (used(code=None, signal=signal.SIGXCPU), "time"),
        (used(cpu_s=CPU + 1), "time"),
        (used(memory_bytes=MEMORY + 1), "memory"),
        (used(code=1, stderr="error: out of memory\n"), "memory"),
    ],
)
def test_what_an_ending_is_called(ending: Ending, kind: str | None) -> None:
    found = fault(ending)
    assert (found and found[0]) == kind


@pytest.mark.parametrize(("more", "fine"), [("error: b\n", True), ("", False), ("error: b\nerror: c\n", False)])
def test_where_all_errors_are_told_there_are_as_many_as_the_first_one_says(more: str, fine: bool) -> None:
    ending = used(code=2, stderr=f"error: a (and 1 more)\n{more}")
    assert (fault(ending, all_told=True) is None) == fine
    assert (fault(ending) is None) == (not more)


def test_what_is_left_behind_by_wrong_input_is_a_fault() -> None:
    wrong = used(code=2, stderr="error: no\n")
    assert fault(wrong, ["out.mcap"]) == ("left behind", "out.mcap")
    assert fault(used(stdout="{"), json_wanted=True) == ("no JSON", "{")


def test_a_command_apart_has_its_own_end() -> None:
    def crash() -> None:
        signal.raise_signal(signal.SIGSEGV)

    def hog() -> int:
        return len(bytearray(2 * MEMORY))

    assert run_apart(lambda: 2).code == 2
    assert run_apart(crash).signal == signal.SIGSEGV
    assert "MemoryError" in run_apart(hog).stderr
    assert "ZeroDivisionError" in run_apart(lambda: 1 // 0).stderr


def test_the_memory_of_a_command_is_without_that_of_its_parent() -> None:
    ballast = bytearray(b"x") * 2**28
    without = run_apart(lambda: None).memory_bytes
    with_as_much = run_apart(lambda: len(ballast * 1) - 2**28).memory_bytes
    assert without < 2**26
    assert with_as_much == pytest.approx(2**28, rel=0.2)
