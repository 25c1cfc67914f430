"""A submission by an installed plug-in: the examples of the pages in a benchmark, handed in, and replayed elsewhere."""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.cli.main import main

DOCS = Path(__file__).parents[1] / "docs"
SUITE = """\
description: The pages' examples
scenario: [paper/simulation_near]
train: 1
held_out: 2
duration: 0.5
set: {reference.solver: none}
governors:
  scalar: {settings: {governor.kind: scalar}, tuning: nothing to tune}
  consensus: {settings: {governor.kind: mine}, tuning: nothing to tune}
networks: {perfect: {}, silent: {network.loss: 1.0}}
"""


def install(folder):
    """Install both examples as packages: a whole-team governor `scalar` and a robot program `mine`."""
    for module, page in (("their_governor", "governor.md"), ("their_program", "how-to/write-a-robot-program.md")):
        text = (DOCS / page).read_text("utf-8")
        (folder / f"{module}.py").write_text(re.search(r"```python\n(.*?)```", text, re.DOTALL).group(1))
        group, name = re.search(r'entry-points\."(.*?)"\]\n(\w+) = "my_package:build"', text).groups()
        info = folder / f"{module}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module.replace('_', '-')}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[{group}]\n{name} = {module}:build\n")


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    install(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        yield folder
    for module in ("their_governor", "their_program"):
        sys.modules.pop(module, None)


@pytest.fixture(scope="module")
def made(installed, tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench")
    (folder / "given.yaml").write_text(SUITE)
    return pbrg.bench(folder / "given.yaml", folder / "out", jobs=1)


def references(made, governor, network):
    """Return the run's m: tick, robot, x y."""
    return pbrg.open(made.folder / "logs" / f"{governor}-{network}-simulation_near-2.mcap").m_m


def test_a_program_runs_under_the_carried_messages_alone(made):
    """Who hears nothing and does not lead never learns of r; a governor that sees the whole team needs no messages."""
    leads = np.isin(np.arange(1, 6), pbrg.load("paper/simulation_near").settings.team.leaders)
    moved = {
        network: np.ptp(references(made, "consensus", network), axis=0).max(axis=1) for network in ("perfect", "silent")
    }
    assert not leads.all() and (moved["perfect"] > 0.01).all()
    assert (moved["silent"][leads] > 0.01).all() and not moved["silent"][~leads].any()
    np.testing.assert_array_equal(references(made, "scalar", "perfect"), references(made, "scalar", "silent"))


def test_the_table_marks_who_sees_the_whole_team_and_counts_what_was_sent(made):
    assert {(row.governor, row.centralized) for row in made.rows} == {("scalar", True), ("consensus", False)}
    for row in made.rows:  # two neighbours, ten rounds, 16 bytes; what is lost was sent
        sent = row.mean("sent_per_robot_per_tick_bytes")
        assert (row.messages, sent) == ((None, None) if row.centralized else (20.0, 320.0)), row
    table = (made.folder / "table.md").read_text()
    assert table.count("| [scalar (centralized)](") == 4 and table.count("| [consensus](") == 4


def test_it_is_handed_in_as_a_folder_and_verified_where_the_plug_in_is_installed(
    made, installed, tmp_path, monkeypatch, capsys
):
    shutil.copytree(made.folder / "logs", tmp_path / "logs")
    for name in ("suite.yaml", "table.md"):
        shutil.copy(made.folder / name, tmp_path)
    assert main(["bench", "--verify", str(tmp_path), "--jobs", "1"]) == 0
    assert capsys.readouterr().out.endswith("every log replays, and the table agrees with the logs\n")
    monkeypatch.setattr(sys, "path", [one for one in sys.path if one != str(installed)])
    assert main(["bench", "--verify", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert (
        "governors.scalar: governor.kind: no governor is called 'scalar'; allowed: " in said and said.count("\n") == 1
    )


CHEAT = """
import pbrg_mj as pbrg

BOARD = {}  # what the leader writes here reaches its team-mates without a message


class Program:
    def start(self, facts, own):
        return own.p

    def begin(self, own, memory):
        if own.reference is not None:
            BOARD["reference"] = own.reference
        return memory

    def send(self, memory):
        return {}, memory

    def receive(self, inbox, memory):
        return memory + 0.01 * (BOARD.get("reference", memory) - memory)

    def finish(self, memory):
        return pbrg.RobotAnswer(memory, "ok"), memory


def build(facts):
    return Program()
"""


def test_programs_that_share_a_variable_of_their_module_take_no_part(installed, tmp_path, monkeypatch, capsys):
    site, suite = tmp_path / "site", tmp_path / "suite.yaml"
    info = site / "cheat-1.0.dist-info"
    info.mkdir(parents=True)
    (site / "cheat.py").write_text(CHEAT)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: cheat\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[pbrg_mj.robot_programs]\nshared = cheat:build\n")
    monkeypatch.syspath_prepend(str(site))
    suite.write_text(SUITE.replace("governor.kind: mine", "governor.kind: shared"))
    assert main(["bench", str(suite), "-o", str(tmp_path / "out")]) == 1
    said = capsys.readouterr().err
    assert "governor 'consensus' of the suite: shared breaks the protocol: " in said and said.count("\n") == 1
    assert not (tmp_path / "out").exists()
