"""The scenarios on the tutorial and the how-to pages run, their commands print what the pages say, citations agree."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from ruamel.yaml import YAML

import pbrg_mj as pbrg
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "docs" / "tutorial.md", *sorted((ROOT / "docs" / "how-to").glob("*.md"))]
FILES = {
    name: text
    for page in PAGES
    for name, text in re.findall(
        r"^```yaml\n# ([\w-]+\.yaml)\n(.*?)^```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE
    )
}
SCENARIOS = {name: text for name, text in FILES.items() if "scenario" not in YAML().load(text)}  # others name some


def test_the_tutorial_and_the_obstacle_page_have_a_whole_scenario():
    assert set(SCENARIOS) == {"first.yaml", "obstacles.yaml"}
    assert set(FILES) - set(SCENARIOS) == {"rounds.yaml", "nids.yaml"}


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_pages_scenario_runs(name, tmp_path):
    path = tmp_path / name
    path.write_text(SCENARIOS[name], encoding="utf-8")
    scenario = load_scenario(path, ["timing.duration=2"]).scenario
    records = list(Simulation.build(scenario).records())
    assert len(records) == 201
    assert {record.solution.status for record in records} == {"ok"}
    before, after = (abs(records[tick].problem.p - scenario.operator.reference).max() for tick in (0, -1))
    assert after < 0.75 * before  # the team is on its way


@pytest.mark.slow
def test_commands_print_what_the_pages_say():
    script = ROOT / "scripts" / "run_pages.py"
    done = subprocess.run([sys.executable, script, "--check"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("printed", "page"),
    [
        (["other  1", "cost gap, mean [m2]  0.3", "rest  2"], ["other  1", "...", "cost gap, mean [m2]  0.3"]),
        (["other  1", "cost, mean gap [m2]  0.3", "rest  2"], ["other  1", "...", "cost, mean gap [m2]  0.3"]),
        (["other  1", "rest  2"], None),
    ],
)
def test_a_row_with_another_label_is_found_and_a_row_that_is_gone_is_not_made_up(printed, page, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "scripts")
    run_pages = import_module("run_pages")

    shown = ["other  7", "...", "cost gap, mean [m2]  0.1"]
    if page is None:
        with pytest.raises(run_pages.GoneError, match="cost gap"):
            run_pages._elided(shown, printed)
    else:
        assert run_pages._elided(shown, printed) == page


def bibtex() -> dict[str, dict[str, str]]:
    entries = re.findall(r"@\w+\{(\w+),\n(.*?)\n\}", (ROOT / "README.md").read_text("utf-8"), re.DOTALL)
    return {key: dict(re.findall(r"(\w+)\s*=\s*\{(.*)\}", body)) for key, body in entries}


def test_citation_file_bibtex_and_version_agree():
    citation = YAML(typ="safe").load((ROOT / "CITATION.cff").read_text("utf-8"))
    software, paper = bibtex()["pbrg_mj"], bibtex()["nguyen2017passivity"]
    assert citation["version"] == pbrg.__version__ == software["version"]
    assert citation["title"] == software["title"].replace("{", "").replace("}", "")
    (reference,) = citation["references"]
    assert reference["title"] == paper["title"].replace("{", "").replace("}", "")
    authors = [f"{author['family-names']}, {author['given-names']}" for author in reference["authors"]]
    assert " and ".join(authors) == paper["author"]
    assert str(reference["year"]) == paper["year"]
