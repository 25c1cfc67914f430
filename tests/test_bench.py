"""`pbrg bench`: its table against records by hand, the same again, and a submission verified or refused."""

from __future__ import annotations

import json
import math
import re
import shutil
from html import escape
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import pbrg_mj as pbrg
from pbrg_mj.cli.main import main
from pbrg_mj.errors import InputError
from pbrg_mj.scenario.families.draw import draw_world
from pbrg_mj.scenario.parse.document import read_document
from pbrg_mj.studies.bench.bench import Bench
from pbrg_mj.studies.bench.columns import quartiles_text
from pbrg_mj.studies.bench.statistics import Difference, Quartiles, shifted_geometric_mean
from pbrg_mj.studies.bench.suite import bundled_suites, read_suite

SUITE = """\
description: "Two governors <b>in</b> the ideal plant"
scenario: [paper/simulation_inadmissible]
train: 1
held_out: 2-3
duration: 1
set: {reference.period: 0.5}
governors:
  none: {settings: {governor.kind: none}, tuning: nothing to tune}
  centralized: {settings: {governor.kind: centralized}, tuning: nothing to tune}
networks: {perfect: {}}
quick:
  {scenario: [paper/simulation_inadmissible], train: 1, held_out: 2, duration: 0.5, governors: [none],
   networks: [perfect]}
"""


def written(folder, text):
    (folder / "given.yaml").write_text(text)
    return folder / "given.yaml"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench")
    return pbrg.bench(written(folder, SUITE), folder / "out", jobs=1)


@pytest.fixture
def submission(made, tmp_path):
    """What is handed in: the suite's file and the logs, as in the docs."""
    folder = tmp_path / "submission"
    folder.mkdir()
    shutil.copytree(made.folder / "logs", folder / "logs")
    shutil.copy(made.folder / "suite.yaml", folder)
    return folder


def test_statistics_are_those_of_independent_code():
    random = np.random.default_rng(5)
    values = random.normal(0.3, 1.0, 9)
    one, fit = Difference.of(values.tolist()), stats.ttest_1samp(values, 0.0).confidence_interval(0.95)
    assert (one.mean, one.low, one.high) == pytest.approx((values.mean(), fit.low, fit.high), rel=1e-12)
    assert (Difference.of([2.0]).low, Difference.of([])) == (-math.inf, None)
    assert Quartiles.of([4.0, 1.0, 2.0, 3.0, 5.0]) == Quartiles(2.0, 3.0, 4.0)
    positive = np.exp(values)
    known = stats.gmean(positive + 0.01) - 0.01
    assert shifted_geometric_mean(positive.tolist(), 0.01) == pytest.approx(known, rel=1e-12)
    assert shifted_geometric_mean([0.0, 0.0], 0.01) == 0.0


def test_rows_are_the_records(made):
    rows = {(row.group, row.governor): row for row in made.rows}
    assert len(rows) == 4
    row = rows["held_out", "centralized"]
    alone = [
        pbrg.run(
            pbrg.load(
                "paper/simulation_inadmissible",
                {"governor.kind": "centralized", "reference.period": 0.5},
                seed=seed,
                duration=1,
            )
        ).metrics
        for seed in (2, 3)
    ]
    assert row.values("optimality_gap_m.mean") == [one.optimality_gap_m.mean for one in alone]
    assert row.by_margin()[0].record["true_margin_min_m"] == min(one.true_margin_min_m for one in alone)
    assert (row.centralized, row.messages, rows["train", "none"].messages) == (True, None, 0.0)
    pairs = [one.record["optimality_gap_m.mean"] for one in rows["held_out", "none"].runs]
    assert row.difference("optimality_gap_m.mean").mean == pytest.approx(
        np.mean(row.values("optimality_gap_m.mean")) - np.mean(pairs)
    )
    assert rows["held_out", "none"].ratios("xi_max_m") == [1.0, 1.0]


def test_the_page_names_every_log_and_command_and_marks_the_centralized(made):
    page = (made.folder / "index.html").read_text()
    assert "&lt;b&gt;in&lt;/b&gt;" in page and "<b>" not in page and "<script" not in page
    assert page.count("<svg") == 2 * len(made.rows)
    table = (made.folder / "table.md").read_text()
    assert "| [centralized (centralized)](runs.md#" in table and table.count("| [none](runs.md#") == 2
    linked = set(re.findall(r'(?:href="|\()(logs/[^")]+)', page + table + (made.folder / "runs.md").read_text()))
    assert linked == {f"logs/{one.log}" for one in made.runs}
    assert all((made.folder / log).is_file() for log in linked)
    command = made.runs[0].task.command(made.runs[0].log)
    assert command.startswith("pbrg run paper/simulation_inadmissible --seed 2 --set ") and escape(command) in page


def test_a_command_makes_the_log_it_stands_by(made, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    from shlex import split

    one = made.runs[-1]
    main([*split(one.task.command("again.mcap"))[1:], "--quiet"])
    again = pbrg.open("again.mcap")
    assert again.metrics.optimality_gap_m.mean == one.record["optimality_gap_m.mean"]
    assert again.scenario.yaml == pbrg.open(made.folder / "logs" / one.log).scenario.yaml


def test_a_second_run_makes_the_same_table(made, tmp_path):
    again = pbrg.bench(written(tmp_path, SUITE), tmp_path / "out", jobs=1)
    for name in ("table.md", "runs.md", "records.parquet"):
        assert (again.folder / name).read_bytes() == (made.folder / name).read_bytes(), name


def test_a_table_does_not_depend_on_the_name_of_its_suites_file(tmp_path):
    text = SUITE.split("\n", 1)[1]  # without description
    tables = []
    for name in ("mine.yaml", "suite.yaml"):
        (tmp_path / name).write_text(text)
        tables.append(Bench(read_suite(tmp_path / name), tmp_path, ()).markdown())
    assert tables[0] == tables[1]


def test_a_submission_of_logs_is_verified(made, submission, capsys):
    assert main(["bench", "--verify", str(submission)]) == 0
    said = capsys.readouterr().out
    assert said.startswith(made.table()) and "worlds of its own suite; every log replays" in said


def test_a_submission_that_lies_is_refused(made, submission, capsys):
    shutil.copy(made.folder / "table.md", submission)
    logs = sorted((submission / "logs").iterdir())
    shutil.copy(logs[0], logs[1])  # another seed's run under this one's name
    logs[2].unlink()
    shutil.copy(logs[3], submission / "logs" / "extra.mcap")
    found = pbrg.verify_bench(submission)
    assert not found.ok
    assert f"logs/{logs[1].name}: is of another scenario than the suite's" in found.problems
    assert "logs/extra.mcap: no run of the suite has this name" in found.problems
    assert "table.md: is not what the logs give" in found.problems
    assert sum(not one.ok for one in found.bench.runs) == 1
    (submission / "suite.yaml").unlink()
    with pytest.raises(InputError, match="has no suite"):
        pbrg.verify_bench(submission)


def test_processes_find_what_one_finds_in_the_same_order(submission, capsys):
    logs = sorted((submission / "logs").iterdir())
    logs[1].write_bytes(logs[0].read_bytes())
    logs[-1].write_bytes(logs[-1].read_bytes()[:-100])
    seen = []
    alone = pbrg.verify_bench(submission, jobs=1)
    several = pbrg.verify_bench(submission, jobs=2, watch=lambda *numbers: seen.append(numbers))
    assert alone.problems == several.problems and len(alone.problems) == 2
    assert alone.bench.table() == several.bench.table()
    total = len(alone.bench.runs)
    assert [one[:2] for one in seen] == [(k, total) for k in range(total + 1)] and seen[-1][2] == 2
    assert main(["bench", "--verify", str(submission), "--force"]) == 2
    assert capsys.readouterr().err == "error: --force does not go with --verify; allowed: --jobs\n"


def test_times_by_the_wall_clock_stand_beside_the_table(made, submission, capsys):
    """In the terminal, in Markdown and on the page, of every row; from the logs alone, too."""
    row = made.rows[0]
    times = sorted(1e3 * one.timings["governor_ms.median"] / one.record["robots"] for one in row.runs)
    assert row.compute_us().median == pytest.approx(np.median(times))
    shown = quartiles_text(row.compute_us())
    lines = [line for line in made.wall_clock().splitlines() if line.startswith(f"{row.governor} ")]
    assert shown in lines[0] and len(made.wall_clock().splitlines()) == 2 + len(made.rows)
    for name in ("wall_clock.md", "index.html"):
        assert shown in (made.folder / name).read_text("utf-8")
    assert pbrg.verify_bench(submission, jobs=1).bench.wall_clock() == made.wall_clock()


@pytest.mark.parametrize(
    ("change", "suite"),
    [
        (("", ""), "standard --quick"),
        (("  held_out: 1001-", "  held_out: 1000-"), None),
        (("stride: 10", "stride: 9"), None),
    ],
)
def test_a_submission_is_told_whose_worlds_it_has(change, suite, tmp_path, capsys):
    """Whoever takes part in them, and whether its logs are any or not."""
    quick = bundled_suites()["standard"].read_text().replace("[none, paper, recommended, centralized]", "[none]")
    (tmp_path / "quick_suite.yaml").write_text(quick.replace(*change))
    no_log(tmp_path, "none-perfect-experiment_near-1")
    found = pbrg.verify_bench(tmp_path)
    assert (found.suite, len(found.bench.runs)) == (suite, 8 if "1000-" in change[1] else 6)
    main(["bench", "--verify", str(tmp_path)])
    said = f"the worlds of the suite {suite}; not verified" if suite else "worlds of its own suite; not verified"
    assert capsys.readouterr().out.splitlines()[-1] == said


def no_log(folder, name):
    """Make an empty file in place of a log."""
    (folder / "logs").mkdir()
    (folder / "logs" / f"{name}.mcap").touch()


def test_the_whole_suite_is_told_from_its_quick_one(tmp_path):
    text = bundled_suites()["standard"].read_text()
    networks, quick = text.index("networks:\n  perfect"), text.index("quick:")
    one = "governors: {mine: {settings: {governor.kind: none}, tuning: nothing to tune}}\n"
    (tmp_path / "suite.yaml").write_text(text[: text.index("governors:")] + one + text[networks:quick])
    no_log(tmp_path, "mine-perfect-long_wall-1")
    assert pbrg.verify_bench(tmp_path).suite == "standard"


OWN = """\
scenario: [far/near.yaml, paper/simulation_near]
train: 1
held_out: 2
duration: 0.3
set: {reference.solver: none}
governors:
  none: {settings: {governor.kind: none}, networks: [perfect], tuning: nothing to tune}
  paper: {settings: {governor.kind: distributed}, tuning: nothing to tune}
networks: {perfect: {}, lossy: {network.loss: 0.5}}
"""


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    """A benchmark of a scenario in a file of one's own, and one network on which `none` has no run."""
    folder = tmp_path_factory.mktemp("own")
    (folder / "far").mkdir()
    text = pbrg.load("paper/simulation_near", {"team.leaders": [1, 3]}).yaml
    (folder / "far" / "near.yaml").write_text(text)
    return pbrg.bench(written(folder, OWN), folder / "out", jobs=1)


def test_a_governor_without_messages_runs_on_one_network_and_is_compared_with_on_all(own):
    labels = [(row.group, row.network, row.governor) for row in own.rows]
    assert ("train", "lossy", "none") not in labels and len(labels) == 6
    lossy = next(row for row in own.rows if (row.group, row.network) == ("held_out", "lossy"))
    assert [(one.world[:2], one.world[2]) for _, one in lossy.paired] == [
        (("near", 2), "perfect"),
        (("paper/simulation_near", 2), "perfect"),
    ]
    alone = pbrg.run(pbrg.load("paper/simulation_near", {"governor.kind": "none", "network.loss": 0.5}, duration=0.3))
    without = pbrg.run(pbrg.load("paper/simulation_near", {"governor.kind": "none"}, duration=0.3))
    assert (alone.arrays["q_true_m"] == without.arrays["q_true_m"]).all()


def test_scenarios_of_ones_own_go_with_the_folder(own, tmp_path):
    """The folder verifies elsewhere, where the file is not, and tells when the copy is another one."""
    folder = tmp_path / "handed_in"
    shutil.copytree(own.folder, folder)
    assert [path.name for path in (folder / "scenarios").iterdir()] == ["near.yaml"]
    (own.folder.parent / "far").rename(own.folder.parent / "gone")
    try:
        found = pbrg.verify_bench(folder)
        assert (found.problems, found.suite) == ((), None)
        copy = folder / "scenarios" / "near.yaml"
        copy.write_text(copy.read_text().replace("- 3", "- 2").replace("1, 3", "1, 2"))
        wrong = [one for one in pbrg.verify_bench(folder).problems if "another scenario" in one]
        assert len(wrong) == 6 and all("-near-" in one for one in wrong)
    finally:
        (own.folder.parent / "gone").rename(own.folder.parent / "far")


def test_quick_runs_have_a_folder_of_their_own(tmp_path, capsys):
    file = str(written(tmp_path, SUITE))
    assert main(["bench", file, "--quick", "-o", str(tmp_path / "out"), "--jobs", "1"]) == 0
    assert "1 of" not in (tmp_path / "out" / "table.md").read_text()
    records = (tmp_path / "out" / "runs.jsonl").read_text().splitlines()[1:]
    assert [json.loads(one)["record"]["duration_s"] for one in records] == [0.5, 0.5]
    assert main(["bench", file, "-o", str(tmp_path / "out")]) == 2
    assert "has the runs of the quick suite" in capsys.readouterr().err


@pytest.mark.parametrize("name", bundled_suites())
def test_bundled_suites_can_be_read_and_say_how_governors_were_tuned(name):
    for quick in (False, True):
        suite = read_suite(name, quick=quick)
        assert all(suite.tunings.values()) and len(set(suite.logs)) == len(suite.tasks)
        assert {task.labels["group"] for task in suite.tasks} == {"held_out", "train"}
        assert "centralized" in suite.centralized and "paper" not in suite.centralized
    assert len(suite.tasks) <= 40


@pytest.mark.parametrize("name", bundled_suites())
def test_bundled_suites_tell_the_sweep_and_the_budget_of_every_tuning(name):
    """And the page that a tuning names has it in a table, by the governor's name in the suite."""
    docs = Path(__file__).parents[1] / "docs"
    for governor, tuning in read_suite(name, quick=False).tunings.items():
        if governor == "none":
            continue
        told = re.fullmatch(r"(.+) in (\d+) trials?, docs/([\w.-]+\.md); .+", tuning)
        assert told, f"{governor}: {tuning}"
        assert f"| {governor} | {told[2]} |" in (docs / told[3]).read_text(), governor


TWO = """\
scenario: [paper/simulation_near, paper/experiment_near]
train: {train}
held_out: {held_out}
seed_stride: {stride}
governors: {{none: {{settings: {{governor.kind: none}}, tuning: nothing to tune}}}}
"""


def test_scenarios_have_seeds_of_their_own_where_a_suite_asks_for_it(tmp_path):
    found = {}
    for stride in (0, 10):
        suite = read_suite(written(tmp_path, TWO.format(train=1, held_out="3,2", stride=stride)))
        found[stride] = [one.removeprefix("none-perfect-").removesuffix(".mcap") for one in suite.logs]
    near, ours = "simulation_near", "experiment_near"
    assert found[0] == [f"{near}-3", f"{ours}-3", f"{near}-2", f"{ours}-2", f"{near}-1", f"{ours}-1"]
    assert found[10] == [f"{near}-3", f"{ours}-13", f"{near}-2", f"{ours}-12", f"{near}-1", f"{ours}-11"]


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("name", bundled_suites())
def test_no_two_worlds_of_a_bundled_suite_share_a_team(name, quick):
    """But for scenarios that draw nothing; and no seed is there to tune on and to compare by."""
    suite = read_suite(name, quick=quick)
    worlds = {(task.source.name, task.seed): task for task in suite.tasks}
    groups = [{seed for _, seed in worlds if seed in group} for group in seeds_by_group(suite)]
    assert not set.intersection(*groups) and sum(map(len, groups)) == len(worlds)
    teams = [team(task) for task in worlds.values() if task.source.name.startswith("families/")]
    assert len(teams) >= (3 if quick else 56)
    for part in zip(*teams, strict=True):
        assert len(set(part)) == len(teams)


def seeds_by_group(suite):
    return [{task.seed for task in suite.tasks if task.labels["group"] == one} for one in ("train", "held_out")]


def team(task):
    """Return starts, formation and reference that the task's family draws."""
    document = read_document(task.source.text, task.source.file)
    document.data["seed"] = task.seed
    drawn = draw_world(document, task.source.file).data
    places = (drawn["team"]["start"], drawn["team"]["formation"], drawn["operator"]["reference"])
    return [json.dumps(one) for one in places]


def test_a_world_of_a_suite_is_that_of_its_seed():
    suite = read_suite("standard")
    one = next(task for task in suite.tasks if task.source.name == "families/corridor" and task.seed > 1000)
    drawn = pbrg.draw("families/corridor", one.seed).settings
    assert one.scenario().settings.team == drawn.team and one.scenario().settings.world == drawn.world


WRONG = {
    SUITE.replace("train: 1\n", "train: 3\n"): "4: held_out: has the seed 3 of `train`",
    SUITE.replace("governors: [none]", "governors: [nothing]"): "12: quick.governors.0: is 'nothing'; allowed: none, ",
    SUITE.replace("governor.kind: none}", "governor.kind: nine}"): "8: governors.none: governor.kind: no governor",
    SUITE.replace("{governor.kind: none}", "{governor.kind: none}, networks: [lossy]"): (
        "8: governors.none.networks.0: is 'lossy'; allowed: perfect"
    ),
    SUITE.replace("[paper/simulation_inadmissible]\ntrain", "[paper/experiment_near, paper/experiment_near]\ntrain"): (
        "2: scenario.1: is a second experiment_near; allowed: each name once"
    ),
    TWO.format(train=1, held_out="32-42", stride=10): "4: seed_stride: gives two scenarios the same seed of `held_out`",
    TWO.format(train=1, held_out=11, stride=10): "3: held_out: has the seed 11 of `train`; allowed: other ones",
    TWO.format(train=1, held_out=2**63 - 5, stride=10): "3: held_out: goes up to 9223372036854775813; allowed: below",
    SUITE.replace(", tuning: nothing to tune", "", 1): "8: governors.none.tuning: is missing",
}


@pytest.mark.parametrize("text", WRONG)
def test_a_wrong_suite_is_one_line(text, tmp_path, capsys):
    assert main(["bench", str(written(tmp_path, text)), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert WRONG[text] in said and said.count("\n") == 1
    assert main(["bench", "standerd"]) == 2 and "nor a suite; allowed: standard" in capsys.readouterr().err
