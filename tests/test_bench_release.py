"""`pbrg bench --release`: a manifest that is the same for the same files, and finds every file that is not."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from dataclasses import replace

import pytest
from mcap.reader import make_reader

import pbrg_mj as pbrg
from pbrg_mj.cli.main import main
from pbrg_mj.errors import InputError
from pbrg_mj.log.read.digest import message_digest
from pbrg_mj.studies.bench import release
from tests.small_bench import small_bench

SUITE = """\
scenario: [paper/simulation_inadmissible]
train: 1
held_out: 2
duration: 0.2
set: {reference.solver: none}
governors: {none: {settings: {governor.kind: none}, tuning: nothing to tune}}
"""
LOG = "logs/none-perfect-simulation_inadmissible-2.mcap"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return small_bench(SUITE, tmp_path_factory)


@pytest.fixture
def folder(made, tmp_path):
    return shutil.copytree(made, tmp_path / "copy")


@pytest.fixture
def released(folder):
    pbrg.release_bench(folder)
    return folder


def test_the_manifest_is_that_of_the_files(folder, made, tmp_path, capsys):
    assert main(["bench", "--release", str(folder)]) == 0
    content = (folder / "release.json").read_bytes()
    whole = hashlib.sha256(content).hexdigest()
    assert capsys.readouterr().out == f"{folder / 'release.json'}: 10 files, SHA-256 {whole}\n"
    manifest = json.loads(content)
    assert list(manifest["files"]) == sorted(manifest["files"]) and str(tmp_path) not in content.decode()
    names = ["index.html", "records.parquet", "runs.jsonl", "runs.md", "suite.yaml", "table.md", "timings.parquet"]
    names.append("wall_clock.md")
    assert set(manifest["files"]) == {*names, LOG, LOG.replace("-2", "-1")}
    for name, digest in manifest["files"].items():
        assert hashlib.sha256((made / name).read_bytes()).hexdigest() == digest
    assert manifest["versions"]["pbrg_mj"] == pbrg.__version__ and len(manifest["machines"]) == 1
    assert pbrg.release_bench(folder).sha256 == whole  # again, and from another place
    assert pbrg.release_bench(shutil.copytree(folder, tmp_path / "elsewhere")).sha256 == whole
    assert main(["bench", "--verify", str(folder)]) == 0
    said = capsys.readouterr().out
    assert f"as released in {folder / 'release.json'}: 10 files, SHA-256 {whole}\n" in said
    assert said.endswith("every log replays, and the table agrees with the logs\n")


def changed(folder):
    content = bytearray((folder / LOG).read_bytes())
    content[len(content) // 2] ^= 1
    (folder / LOG).write_bytes(content)


def linked(folder):
    (folder / LOG).rename(folder.parent / "away.mcap")
    (folder / LOG).symlink_to(folder.parent / "away.mcap")


CHANGES = {
    f"{LOG} differs": changed,
    f"{LOG} is missing": lambda folder: (folder / LOG).unlink(),
    "logs/more.mcap was added": lambda folder: shutil.copy(folder / LOG, folder / "logs" / "more.mcap"),
    "notes/a was added, notes/b was added, notes/c was added and 1 more": lambda folder: notes(folder),
    f"{LOG} differs,": lambda folder: (linked(folder), (folder / "table.md").write_text("")),
    "logs/pipe was added": lambda folder: os.mkfifo(folder / "logs" / "pipe"),
}


def notes(folder):
    (folder / "notes").mkdir()
    for name in "abcd":
        (folder / "notes" / name).touch()


@pytest.mark.parametrize("message", CHANGES)
def test_what_is_not_as_released_is_one_line_before_any_replay(message, released, monkeypatch, capsys):
    monkeypatch.setattr("pbrg_mj.studies.bench.verify.verify", lambda log: pytest.fail("replayed"))
    CHANGES[message](released)
    assert main(["bench", "--verify", str(released)]) == 1
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1
    assert said.err.startswith(f"error: {released / 'release.json'}: not the files that were released: ")
    assert message in said.err


@pytest.mark.parametrize(
    "name", ["../out/table.md", "/etc/passwd", "logs/../table.md", "./table.md", "logs//a", "", ".", ".."]
)
def test_places_outside_of_the_folder_are_refused(name, released, capsys):
    manifest = json.loads((released / "release.json").read_text())
    manifest["files"][name] = "0" * 64
    (released / "release.json").write_text(json.dumps(manifest))
    assert main(["bench", "--verify", str(released)]) == 2
    said = capsys.readouterr().err
    assert f"release.json: {name!r}: allowed: a place inside the folder" in said and said.count("\n") == 1


@pytest.mark.parametrize(
    "content",
    [
        "",
        "{",
        "[]",
        "[" * 100_000,
        '{"format": 2, "files": {}}',
        '{"format": 1}',
        '{"format": 1, "files": {"a": "b"}}',
        "\xff",
    ],
)
def test_a_manifest_that_is_none_is_one_line(content, released, capsys):
    (released / "release.json").write_bytes(content.encode("latin-1"))
    assert main(["bench", "--verify", str(released)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"error: {released / 'release.json'}: ") and said.count("\n") == 1


@pytest.mark.parametrize("name", ["table.md", "records.parquet", "suite.yaml", "logs"])
def test_what_is_not_finished_is_not_released(name, folder):
    shutil.rmtree(folder / name) if name == "logs" else (folder / name).unlink()
    with pytest.raises(InputError, match=f"copy: has no {name.removesuffix('.yaml')}"):
        pbrg.release_bench(folder)
    assert not (folder / "release.json").exists()


def test_links_and_logs_of_several_versions_are_not_released(folder, monkeypatch):
    (folder / "link").symlink_to("/etc")
    with pytest.raises(InputError, match="link: is a link or no file"):
        pbrg.release_bench(folder)
    (folder / "link").unlink()
    read = release.read_header
    monkeypatch.setattr(
        release, "read_header", lambda log: replace(read(log), versions={"numpy": log.stem[-1], "processor": "any"})
    )
    with pytest.raises(InputError, match=r"was made with another numpy than none-perfect-.*-1"):
        pbrg.release_bench(folder)
    assert not (folder / "release.json").exists()


def test_folders_go_alone(folder, capsys):
    assert main(["bench", "standard", "--release", str(folder)]) == 2
    assert main(["bench", "--release", str(folder), "--verify", str(folder)]) == 2
    assert capsys.readouterr().err.count("takes a folder alone") == 2


def test_logs_made_elsewhere_are_held_to_the_released_messages(released, made, tmp_path, capsys):
    """Whole logs differ where the machine's name does; what they say must not."""
    manifest = released / "release.json"
    other = shutil.copytree(made, tmp_path / "other")
    assert main(["bench", "--verify", str(other), "--against", str(manifest)]) == 0
    assert f"every log has the messages of those released in {manifest}\n" in capsys.readouterr().out
    shutil.copy(other / LOG.replace("-2", "-1"), other / LOG)
    (other / LOG.replace("-2", "-1")).rename(other / "logs" / "more.mcap")
    assert main(["bench", "--verify", str(other), "--against", str(manifest)]) == 1
    said = capsys.readouterr().out
    assert f"{LOG}: has other messages than the released log\n" in said
    assert f"{LOG.replace('-2', '-1')}: released, and not here\n" in said
    assert "logs/more.mcap: is not among the released logs\n" in said and "every log has" not in said


def test_the_messages_digest_is_that_of_an_independent_reader(made):
    """mcap's own reader, which knows nothing of ours, finds the same bytes in the same order."""
    digest, log = hashlib.sha256(), made / LOG
    with log.open("rb") as file:
        reader = make_reader(file)
        found = [(one.name, 0, one.data) for one in reader.iter_attachments()]
        messages = reader.iter_messages(log_time_order=False)
        found += [(channel.topic, one.log_time, one.data) for _, channel, one in messages]
    assert {"scenario.yaml", "/tick", "/timing"} <= {name for name, _, _ in found}
    for name, time, data in found:
        if name != "/timing":
            digest.update(f"{len(name)} {name} {time} {len(data)}\n".encode() + data)
    assert message_digest(log) == digest.hexdigest()


def test_the_messages_digest_tells_runs_apart_and_not_machines(made, tmp_path, monkeypatch):
    monkeypatch.setattr("pbrg_mj.log.write.provenance.processor", lambda: "another one")
    scenario = pbrg.load("paper/simulation_near", ["timing.duration=0.05", "log.timings=false"])
    pbrg.run(scenario, log=tmp_path / "elsewhere.mcap")
    monkeypatch.undo()
    pbrg.run(scenario, log=tmp_path / "here.mcap")
    pbrg.run(scenario.override(["seed=3"]), log=tmp_path / "other.mcap")
    here, elsewhere, other = (tmp_path / f"{name}.mcap" for name in ("here", "elsewhere", "other"))
    assert here.read_bytes() != elsewhere.read_bytes() and message_digest(here) == message_digest(elsewhere)
    assert message_digest(other) != message_digest(here)
    elsewhere.write_bytes(here.read_bytes()[:-400])
    with pytest.raises(InputError, match=r"elsewhere.mcap: "):
        message_digest(elsewhere)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "cannot be read: No such file or directory"),
        ('{"format": 1, "files": {}}', "messages: is missing; required: SHA-256 by file"),
        ('{"format": 1, "messages": {"../a": "b"}}', "allowed: a place inside the folder"),
    ],
)
def test_a_wrong_manifest_of_another_release_is_one_line(content, message, folder, tmp_path, capsys):
    if content is not None:
        (tmp_path / "given.json").write_text(content)
    assert main(["bench", "--verify", str(folder), "--against", str(tmp_path / "given.json")]) == 2
    said = capsys.readouterr()
    assert said.err.startswith(f"error: {tmp_path / 'given.json'}") and message in said.err and said.out == ""
    assert main(["bench", "--against", str(tmp_path / "given.json")]) == 2
    assert "allowed: pbrg bench --verify DIR --against FILE" in capsys.readouterr().err
