"""The report as a file: whole, safe whatever the log says, the same at every repetition, and not too large."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import subprocess
import sys
import zipfile
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from pbrg_mj.analysis.report.page import SCRIPTS, page
from pbrg_mj.analysis.report.report_run import report_run
from pbrg_mj.api import logs as api_logs
from pbrg_mj.cli.main import main
from tests.runs import replaced, resting, run, walled
from tests.test_analysis_binding import multipliers, sensed

TOP = Path(__file__).parents[1]
EVIL = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"


class Parsed(HTMLParser):
    """Elements with their attributes and text, as a browser tells them apart."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.texts, self.inside = [], [], ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        self.inside = tag

    def handle_endtag(self, tag):
        self.inside = ""

    def handle_data(self, data):
        self.texts.append((self.inside, data))

    def all(self, tag):
        return [attributes for name, attributes in self.elements if name == tag]

    def text(self, tag):
        return [data for name, data in self.texts if name == tag]


def made(*runs):
    return page([report_run(one, len(runs)) for one in runs])


def hostile():
    status = np.full(21, "ok", dtype="<U80")
    status[5:] = EVIL
    return run(
        ticks={"status": status},
        path=f"/tmp/{EVIL.replace('/', '_')}.mcap",
        name=EVIL,
        scenario_yaml=f"description: {EVIL}\n",
        versions={EVIL: EVIL, "python": EVIL},
        damage=EVIL,
    )


def test_text_from_a_log_is_never_markup():
    parsed, harmless = Parsed(made(hostile(), hostile())), Parsed(made(run(), run()))
    assert len(parsed.all("script")) == 2
    assert not parsed.all("img")
    assert parsed.text("script")[1] == harmless.text("script")[1]
    assert {tag for tag, _ in parsed.elements} == {tag for tag, _ in harmless.elements}
    assert not any(name.startswith("on") for _, attributes in parsed.elements for name in attributes)
    video = json.loads(parsed.text("script")[0])[0]
    assert video["name"] == EVIL
    assert video["events"][0]["text"] == f"governor: {EVIL}"
    shown = "".join(data for tag, data in parsed.texts if tag != "script")
    assert shown.count(f"Damaged log: {EVIL}") == 2
    assert f"description: {EVIL}" in shown


def test_what_binds_at_the_end_stands_beside_the_outcome():
    bound = run(walled(), ticks={"multipliers": multipliers((0, 1, 3.1)), **sensed()})
    said = "robot 1's half-space x <= 2.1 (walls.0), holding robot 2, lambda 3.1"
    assert said in Parsed(made(bound)).text("li")
    assert "Binds at the end:" not in Parsed(made(run(walled()))).text("p")


def test_control_characters_are_spelt_out():
    text = made(run(name="a\x1b[31m\u202eb", scenario_yaml="seed: 1\nname: \x00\n"))
    assert not set("\x1b\u202e\x00") & set(text)
    assert "a\\x1b[31m\\u202eb" in text


def test_the_policy_allows_this_script_and_this_style_and_nothing_else():
    text = made(run())
    parsed = Parsed(text)
    policy = next(meta["content"] for meta in parsed.all("meta") if meta.get("http-equiv"))
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))

    def digest(tag):
        inner = re.findall(f"<{tag}>(.*?)</{tag}>", text, re.S)
        assert len(inner) == 1
        return f"'sha256-{base64.b64encode(hashlib.sha256(inner[0].encode()).digest()).decode()}'"

    assert rules == {
        "default-src": "'none'",
        "script-src": digest("script"),
        "style-src": digest("style"),
        "base-uri": "'none'",
        "form-action": "'none'",
    }
    assert not any({"src", "href", "style"} & set(attributes) for _, attributes in parsed.elements)
    assert set(re.findall(r"[a-z]+://[^\s'\"]+", text)) == {"http://www.w3.org/2000/svg"}  # a name, not an address


def test_the_same_runs_give_the_same_bytes_wherever_their_logs_lie():
    one, other = run(path="/here/run.mcap"), run(path="/there/run.mcap")
    assert made(one, run()) == made(other, run())
    assert made(one) != made(run(name="another"))


def test_several_runs_stand_side_by_side():
    parsed = Parsed(made(run(name="first"), run(walled(), name="second"), run(name="third")))
    assert len(parsed.all("article")) == 3
    assert parsed.text("title") == ["first, second, third - pbrg report"]
    heads = [attributes for attributes in parsed.all("th") if attributes.get("scope") == "col"]
    assert len(heads) == 2 * (1 + 3)  # of the comparison and of the versions
    assert [video["name"] for video in json.loads(parsed.text("script")[0])] == ["first", "second", "third"]


def long_run(robots, steps):
    places = tuple((0.5 * k, 0.0) for k in range(robots))
    plan = walled(team={"start": places, "formation": places, "leaders": (1,)})
    ticks = vars(resting(plan, steps))
    rng = np.random.default_rng(2)
    ticks |= {"time": 0.01 * np.arange(steps), "m": ticks["m"] + rng.normal(size=ticks["m"].shape)}
    shape = (steps, robots, 4)  # other half-spaces at every tick
    ticks |= {"half_space_G": np.ones((*shape, 2)), "half_space_h": rng.normal(size=shape)}
    ticks |= {
        "half_space_active": np.ones(shape, dtype=bool),
        "half_space_binds": np.ones((*shape, robots), dtype=bool),
    }
    return run(plan, ticks=ticks)


@pytest.mark.parametrize(("robots", "steps", "runs"), [(5, 6001, 1), (50, 6001, 1), (50, 2001, 4)])
def test_small_and_large_teams_and_several_of_them_stay_below_8_MB(robots, steps, runs):
    one = report_run(long_run(robots, steps), runs)
    assert len(page([one] * runs).encode()) < 8e6


def test_a_diverged_run_and_a_run_of_one_tick_can_be_shown():
    m = np.full((21, 2, 2), np.inf)
    assert len(made(run(ticks={"m": m, "hand_true": np.full((21, 2, 2), np.nan)}))) > 10_000
    first = {name: value[:1] for name, value in vars(resting(walled())).items()}
    assert len(made(run(walled(), ticks=first))) > 10_000


LOGS = ("a.mcap", "b.mcap")


@pytest.fixture
def logs(monkeypatch, tmp_path):
    """Planted runs in place of log files, which are there and empty."""
    monkeypatch.setattr(api_logs, "report_log", lambda path, runs: report_run(replaced(run(), path=str(path)), runs))
    monkeypatch.chdir(tmp_path)
    for name in LOGS:
        (tmp_path / name).touch()
    return tmp_path


def test_the_command_writes_one_page_of_all_logs(logs, capsys):
    assert main(["report", *LOGS, "-o", "out.html"]) == 0
    assert [video["log"] for video in json.loads(Parsed((logs / "out.html").read_text()).text("script")[0])] == [*LOGS]
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(("output", "says"), [("out.pdf", ".html"), ("nowhere/out.html", "cannot write here")])
def test_a_wrong_name_or_place_is_one_line_and_exit_code_2(logs, capsys, output, says):
    assert main(["report", "a.mcap", "-o", output]) == 2
    told = capsys.readouterr().err
    assert told.startswith("error: ")
    assert says in told
    assert told.count("\n") == 1
    assert sorted(path.name for path in logs.iterdir()) == [*LOGS]


def test_a_wheel_holds_all_that_the_page_is_made_of(tmp_path):
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(command, cwd=TOP, check=True, capture_output=True)
    with zipfile.ZipFile(next(tmp_path.glob("*.whl"))) as archive:
        held = {Path(name).name for name in archive.namelist() if "report/assets/" in name}
    assert held == {"page.html", "style.css", *(f"{name}.js" for name in SCRIPTS)}
