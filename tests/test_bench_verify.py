"""What `pbrg bench --verify` must not take for verified, and what it says of what is not there."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest

import pbrg_mj as pbrg
from pbrg_mj.cli.main import main
from pbrg_mj.errors import InputError
from pbrg_mj.scenario.bundled import bundled_families
from pbrg_mj.studies.bench.suite import bundled_suites
from pbrg_mj.world.plant.ideal import IdealPlant
from tests.small_bench import small_bench

SUITE = """\
scenario: [paper/simulation_near]
train: 1
held_out: 2
duration: 0.1
set: {reference.solver: none, log.timings: false}
governors:
  none: {settings: {governor.kind: none}, tuning: nothing to tune}
  paper: {settings: {governor.kind: distributed}, tuning: nothing to tune}
networks: {lossy: {network.loss: 0.5}}
"""
LOG = "paper-lossy-simulation_near-2.mcap"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return small_bench(SUITE, tmp_path_factory)


@pytest.fixture
def folder(made, tmp_path):
    return shutil.copytree(made, tmp_path / "copy")


def verified(folder, capsys):
    """Return exit code, the last line, and what is on stderr."""
    code = main(["bench", "--verify", str(folder)])
    said = capsys.readouterr()
    return code, (said.out.splitlines() or [""])[-1], said.err


@pytest.mark.parametrize("change", ["no folder", "an empty folder", "logs of other runs", "links to nowhere"])
def test_a_folder_without_logs_is_no_benchmark(change, folder, capsys):
    logs = folder / "logs"
    logs.rename(folder / "elsewhere")
    if change != "no folder":
        logs.mkdir()
    if change == "logs of other runs":
        shutil.copy(folder / "elsewhere" / LOG, logs / "mine.mcap")
    if change == "links to nowhere":
        (logs / LOG).symlink_to("/nonexistent/log.mcap")
    code, said, error = verified(folder, capsys)
    first = "none-lossy-simulation_near-2.mcap"
    assert (code, said) == (2, "")
    assert error == f"error: {folder}: has no log of its suite's runs; required: such as logs/{first}\n"


def test_what_there_is_not_is_not_said_to_agree(folder, capsys):
    assert verified(folder, capsys)[1].endswith("; every log replays, and the table agrees with the logs")
    (folder / "table.md").unlink()
    assert verified(folder, capsys)[1].endswith("; every log replays, and there is no table.md to compare")
    (folder / "logs" / LOG).unlink()
    code, said, _ = verified(folder, capsys)
    assert code == 0
    assert said.endswith("; 3 of 4 runs have a log that replays, the rest none, and there is no table.md to compare")


@pytest.mark.parametrize("change", [lambda text: b"\xff\xfe", lambda text: text.replace(b"\n", b"\r\n")])
def test_a_table_of_other_bytes_is_another_one(change, folder, capsys):
    table = folder / "table.md"
    table.write_bytes(change(table.read_bytes()))
    assert main(["bench", "--verify", str(folder)]) == 1
    assert "\ntable.md: is not what the logs give\n" in capsys.readouterr().out


def test_robots_in_processes_lose_nothing_and_are_not_the_suites(folder, capsys):
    """Their log names the suite's scenario, whose network loses half of the messages, and replays without a loss."""
    scenario = pbrg.open(folder / "logs" / LOG).scenario
    pbrg.run(scenario, log=folder / "logs" / LOG, force=True, processes=True)
    assert pbrg.open(folder / "logs" / LOG).scenario.yaml == scenario.yaml
    assert pbrg.verify(folder / "logs" / LOG).ok
    assert main(["bench", "--verify", str(folder)]) == 1
    said = capsys.readouterr().out
    assert f"\nlogs/{LOG}: its robots were processes of their own, which those of a suite are not\n" in said


def test_a_cut_log_is_not_verified(folder, capsys):
    log = folder / "logs" / LOG
    log.write_bytes(log.read_bytes()[:-2000])
    code, said, _ = verified(folder, capsys)
    assert code == 1 and said.endswith("; not verified")


def test_logs_from_elsewhere_that_differ_in_bits_are_counted(folder, monkeypatch, capsys):
    """As on another kind of processor: the log names it, and its numbers are within the tolerance."""
    log, advance = folder / "logs" / LOG, IdealPlant.advance
    scenario = pbrg.open(log).scenario
    with monkeypatch.context() as patch:
        patch.setattr("pbrg_mj.log.write.provenance.processor", lambda: "another one")
        patch.setattr(IdealPlant, "advance", lambda self, command: advance(self, command + 1e-9))
        pbrg.run(scenario, log=log, force=True)
    (folder / "table.md").unlink()
    code, said, _ = verified(folder, capsys)
    assert code == 0
    assert "; every log replays, 1 of them from elsewhere to other bits within 1e-06, and there is no" in said


STANDARD = bundled_suites()["standard"].read_text()


def quick_suite(folder, settings):
    """A submission of one governor to the quick standard suite, with a file in place of a log: whose worlds it has."""
    text = STANDARD[: STANDARD.index("governors:")]
    text += f"governors: {{mine: {{settings: {settings}, tuning: nothing to tune}}}}\nnetworks: {{perfect: {{}}}}\n"
    text += STANDARD[STANDARD.index("quick:") :].replace("[none, paper, recommended, centralized]", "[mine]")
    (folder / "quick_suite.yaml").write_text(text)
    (folder / "logs").mkdir()
    (folder / "logs" / "mine-perfect-boxes-1011.mcap").touch()
    return folder


@pytest.mark.parametrize(
    ("settings", "suite"),
    [
        ("{governor.kind: certified, governor.margin: 0.02, control.separation: 0.22}", "standard --quick"),
        ("{governor.kind: none, sensors.beams.noise_std: 0.0}", None),
        ("{governor.kind: none, network: {loss: 0.0}}", None),
    ],
)
def test_a_governor_that_changes_the_world_has_worlds_of_its_own(settings, suite, tmp_path):
    assert pbrg.verify_bench(quick_suite(tmp_path, settings)).suite == suite


@pytest.mark.parametrize(
    ("place", "suite", "world"),
    [
        ("families/boxes", "standard --quick", "families/boxes"),
        ("scenarios/boxes.yaml", None, "families/long_wall"),
    ],
)
def test_files_in_the_folder_do_not_pass_for_bundled_scenarios(place, suite, world, tmp_path, monkeypatch):
    """Another world under a bundled name: what is beside the suite is not read, and a copy is one's own."""
    quick_suite(tmp_path, "{governor.kind: none}")
    (tmp_path / place).parent.mkdir()
    (tmp_path / place).write_text(bundled_families()["families/long_wall"].read_text())
    monkeypatch.chdir(tmp_path)
    found = pbrg.verify_bench(Path())
    boxes = next(run.task.source.text for run in found.bench.runs if "boxes" in run.log)
    assert (found.suite, boxes) == (suite, bundled_families()[world].read_text())


def test_no_scenario_is_read_from_outside_of_the_folder(folder, tmp_path):
    (tmp_path / "mine.yaml").write_text(pbrg.load("paper/simulation_near").yaml)
    suite = folder / "suite.yaml"
    suite.write_text(suite.read_text().replace("paper/simulation_near", "../mine.yaml"))
    with pytest.raises(InputError, match=r"scenario\.0: is not bundled; required: scenarios/mine\.yaml in .*copy$"):
        pbrg.verify_bench(folder)


@pytest.mark.parametrize("key", ["versions", "machines", "messages"])
def test_a_manifest_that_says_else_than_the_logs_is_one_line(key, folder, capsys):
    path = pbrg.release_bench(folder).path
    manifest = json.loads(path.read_text())
    manifest[key] = {LOG: "0" * 64} if key == "messages" else manifest[key] * 2 if key == "machines" else {}
    path.write_text(json.dumps(manifest))
    assert verified(folder, capsys) == (1, "", f"error: {path}: not what the logs say: {key}\n")


@pytest.mark.parametrize("kind", ["link", "link to nowhere", "folder", "pipe"])
def test_a_manifest_that_is_no_file_is_not_passed_over(kind, folder, tmp_path, capsys):
    path = pbrg.release_bench(folder).path
    path.rename(tmp_path / "away.json")
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to(tmp_path / ("away.json" if kind == "link" else "nowhere.json"))
    assert verified(folder, capsys) == (2, "", f"error: {path}: is a link or no file; allowed: a manifest\n")
