"""The tables of `pbrg bench` in words, of planted records: paired differences against independent code."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from markdown_it import MarkdownIt
from scipy import stats

from pbrg_mj.studies.bench.markdown import as_markdown, runs_markdown
from pbrg_mj.studies.bench.page import page
from pbrg_mj.studies.bench.suite import Suite, bundled_suites, read_suite
from pbrg_mj.studies.bench.table import Row, bench_runs, table
from pbrg_mj.studies.bench.text import as_text
from pbrg_mj.studies.task import Source, Task

GAP, LEFT, MARGIN = "optimality_gap_m.mean", "terminal_gap_m", "true_margin_min_m"
SETTLING = "settling_time_including_violated_s"
NONE = {  # by seed: gap, distance left, settling time, least margin
    1: (0.5, 0.25, 8.0, -0.1),
    2: (None, 1.5, None, 0.2),
    3: (0.25, 0.125, 6.0, 0.3),
    4: (1.0, 0.5, 7.0, None),
}
MINE = {
    1: (0.25, 0.5, 9.0, 0.1),
    2: (0.125, 0.5, 12.0, 0.25),
    3: (0.125, 0.375, None, 0.25),
    4: None,  # failed
}


LINK = "[mine](runs.md#held_out-{}-mine)"


def record(numbers):
    if numbers is None:
        return {"status": "failed", "error": "broken"}
    fixed = {"status": "ok", "outcome": "converged", "duration_s": 10.0, "governor_not_ok_share": 0.25, "robots": 5}
    fixed |= {"wall_contacts": 0, "moving_contacts": 0, "robot_contacts": 0, "rounds_per_tick": 2.0}
    return fixed | dict(zip((GAP, LEFT, SETTLING, MARGIN), numbers, strict=True))


@pytest.fixture
def planted() -> tuple[Suite, list[Row]]:
    """`none` on the first network alone, `mine` on both."""
    source = Source.of("paper/simulation_near", bundled_suites()["standard"].parent)
    ran = [("none", "perfect", NONE), ("mine", "perfect", MINE), ("mine", "10 % lost", MINE)]
    tasks, results = [], []
    for governor, network, found in ran:
        for seed, numbers in found.items():
            labels = {"group": "held_out", "governor_name": governor, "network_name": network}
            tasks.append(Task(source, {}, seed, labels))
            results.append((record(numbers), {}))
    logs = tuple(f"{k}.mcap" for k in range(len(tasks)))
    suite = replace(read_suite("standard", quick=True), tasks=tuple(tasks), logs=logs, centralized=frozenset())
    return suite, table(suite, bench_runs(suite, results))


def expected(metric):
    """Return mean, interval and number of the pairs that both have, by scipy."""
    column = (GAP, LEFT, SETTLING, MARGIN).index(metric)
    pairs = [(MINE[seed][column], NONE[seed][column]) for seed in NONE if MINE[seed] is not None]
    mine, none = zip(*(pair for pair in pairs if None not in pair), strict=True)
    found = stats.ttest_rel(mine, none)
    mean, interval = sum(mine) / len(mine) - sum(none) / len(none), found.confidence_interval(0.95)
    return mean, interval.low, interval.high, len(mine)


def numbers(cell):
    mean, low, high, pairs = re.fullmatch(r"(\S+) \[(\S+), (\S+)\] \((\d+)\)", cell).groups()
    return float(mean), float(low), float(high), int(pairs)


@pytest.mark.parametrize("network", ["perfect", "10 % lost"])
def test_differences_are_those_of_the_worlds_that_both_have(network, planted):
    suite, rows = planted
    part = as_markdown(suite, rows).split("differences to none", 1)[1].split("\n## ")[0]
    lines = [line.strip("| ").split(" | ") for line in part.splitlines() if line.startswith("|")]
    assert [line[:2] for line in lines[2:]] == [
        [LINK.format("perfect"), "perfect"],
        [LINK.format("10_lost"), "10 % lost"],
    ]
    cells = dict(zip(lines[0], next(line for line in lines if line[1:2] == [network]), strict=True))
    for title, metric in (
        ("gap to the optimum [m]", GAP),
        ("distance left [m]", LEFT),
        ("least margin [m]", MARGIN),
    ):
        assert numbers(cells[title]) == pytest.approx(expected(metric), rel=5e-3), title
    assert numbers(cells["settling time [s]"]) == (1.0, float("-inf"), float("inf"), 1)  # of the one world both have


def test_the_terminal_has_the_same_differences_and_no_links(planted):
    suite, rows = planted
    text = as_text(rows)
    assert "](" not in text and text.count("differences to none in the same world, mean [95 %] (pairs)\n") == 2
    part = as_markdown(suite, rows).split("differences to none", 1)[1].split("\n## ")[0]
    found = re.findall(r"\S+ \[\S+, \S+\] \(\d+\)", part)
    assert len(found) == 8
    for cell in found:
        assert cell in text


def sections(text):
    """Return the runs of `runs.md` by their anchors, each a dict by column."""
    found = {}
    for part in text.split('## <a id="')[1:]:
        head, _, *lines = [line.strip("| ").split(" | ") for line in part.splitlines() if line.startswith("|")]
        found[part.split('"')[0]] = [dict(zip(head, line, strict=True)) for line in lines]
    return found


def lines_of(suite, rows):
    """Return the lines of the table's first part, without its differences, each a dict by column."""
    part = as_markdown(suite, rows).split("Held-out seeds: ")[0]
    head, _, *lines = [line.strip("| ").split(" | ") for line in part.splitlines() if line.startswith("|")]
    return [dict(zip(head, line, strict=True)) for line in lines]


def test_each_row_leads_to_the_runs_that_give_its_numbers(planted):
    suite, rows = planted
    runs = sections(runs_markdown(rows))
    lines = lines_of(suite, rows)
    anchors = [re.search(r"\(runs\.md#(\w+-\w+-\w+)\)", line["governor"])[1] for line in lines]
    assert anchors == list(runs) == ["held_out-perfect-none", "held_out-perfect-mine", "held_out-10_lost-mine"]
    for line, anchor in zip(lines, anchors, strict=True):
        given = [one for one in runs[anchor] if not one["ended"].startswith("failed")]
        assert line["runs"] == f"[4{'' if len(given) == 4 else ', 1 failed'}](runs.md#{anchor})"
        for column in ("gap to the optimum [m]", "distance left [m]"):
            values = [float(one[column]) for one in given if one[column] != "-"]
            shown = [float(one) for one in re.findall(r"[\d.]+", line[column])]
            assert shown[:3] == pytest.approx(np.percentile(values, [50, 25, 75]), rel=5e-3)
            assert shown[3:] == ([] if len(values) == len(given) else [len(values), len(given)])
        crossed = sum(one["crossing"] == "yes" for one in given)
        assert line["crossings [95 %]"].startswith(f"{100 * crossed / len(given):.0f} % [")
        assert float(line["infeasible [s]"]) == np.mean([float(one["infeasible [s]"]) for one in given]) == 2.5
        least, log = re.fullmatch(r"\[(\S+)\]\(logs/(\S+)\)", line["least margin [m]"]).groups()
        worst = next(one for one in given if f"(logs/{log})" in one["log"])
        assert worst["least margin [m]"] == least == min((one["least margin [m]"] for one in given), key=margin)


def margin(text):
    return float("inf") if text == "-" else float(text)


def test_a_run_leads_to_its_log_its_command_and_the_run_that_it_is_compared_with(planted):
    runs = sections(runs_markdown(planted[1]))
    mine = runs["held_out-10_lost-mine"]
    assert [one["compared with"] for one in mine] == ["[0.mcap](logs/0.mcap)", "[1.mcap](logs/1.mcap)", LOG_2, "-"]
    assert [one["log"] for one in mine] == [*(f"[{k}.mcap](logs/{k}.mcap)" for k in (8, 9, 10)), "11.mcap"]
    assert mine[3]["ended"] == "failed: broken" and mine[3]["distance left [m]"] == "-"
    assert mine[0]["command"] == "`pbrg run paper/simulation_near --seed 1 -o 8.mcap`"
    assert {one["compared with"] for one in runs["held_out-perfect-none"]} == {"-"}


LOG_2 = "[2.mcap](logs/2.mcap)"


def test_links_inside_the_page_lead_somewhere(planted, tmp_path):
    suite, rows = planted
    text = page(suite, rows, tmp_path, {})
    inside, there = re.findall(r'href="#([^"]*)"', text), re.findall(r'id="([^"]*)"', text)
    assert set(inside) == set(there) and len(there) == len(rows) == len(set(there))
    assert len(inside) == 3 * len(rows) + 2  # name, count, wall clock; differences but of none
    for one in sections(runs_markdown(rows))["held_out-perfect-mine"][:3]:
        assert f"<td>{one['distance left [m]']}</td>" in text


def test_without_none_there_is_no_table_of_differences(planted):
    suite, rows = planted
    alone = [replace(row, paired=()) for row in rows if row.governor != "none"]
    assert "differences" not in as_text(alone) + as_markdown(suite, alone)


def test_text_of_suites_is_no_markup_in_any_table(planted, tmp_path):
    suite, rows = planted
    hostile = "<script>a</script> | [x](http://y) `*b*`"
    file = replace(suite.file, keys=suite.file.keys.model_copy(update={"description": hostile}))
    suite = replace(suite, file=file, tunings={hostile: hostile})
    rows = [replace(row, governor=hostile, network=hostile) for row in rows]
    for text in (as_markdown(suite, rows), runs_markdown(rows)):
        shown = MarkdownIt("commonmark").enable("table").render(text)
        assert "<script" not in shown and 'http://y"' not in shown and "<em>b" not in shown
        assert "&lt;script&gt;a&lt;/script&gt; | [x](http://y) `*b*`" in shown
    assert "<script>a" not in page(suite, rows, tmp_path, {})
