"""The layout for Foxglove and Lichtblick names nothing that the log of the paper's five robots does not have."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from pbrg_mj.log.read.run import TOPICS
from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.fields import MESSAGES

LAYOUT = json.loads((Path(__file__).parents[1] / "docs" / "foxglove" / "layout.json").read_text())
DIMS = {"n": 5, "K": 4, "R": 20}  # the paper's team with the default slots
PATH = re.compile(r"(?P<topic>/\w+)\.(?P<field>\w+)(?:\[(?P<place>\d+)\])?")


def panels(node: Any) -> list[str]:
    return [node] if isinstance(node, str) else [*panels(node["first"]), *panels(node["second"])]


def test_it_has_the_classic_form_and_shows_every_panel_once() -> None:
    assert set(LAYOUT) == {"configById", "globalVariables", "userNodes", "playbackConfig", "layout"}
    shown = panels(LAYOUT["layout"])
    assert sorted(shown) == sorted(LAYOUT["configById"])
    assert {panel.split("!")[0] for panel in shown} == {"3D", "Plot", "RosOut"}


def test_every_path_leads_to_a_number() -> None:
    plotted = [path["value"] for panel in LAYOUT["configById"].values() for path in panel.get("paths", ())]
    assert len(plotted) == len(set(plotted)) > 20
    for value in plotted:
        match = PATH.fullmatch(value)
        assert match is not None, value
        fields = {field.name: field for field in MESSAGES[TOPICS[match["topic"]]]}
        field = fields[match["field"]]
        assert field.kind == "double"
        assert (match["place"] is None) == (field.shape == ()), value
        assert int(match["place"] or 0) < field.count(DIMS), value


def test_references_margins_and_multipliers_are_plotted_for_all() -> None:
    plotted = {path["value"] for panel in LAYOUT["configById"].values() for path in panel.get("paths", ())}
    for robot in range(5):
        assert {f"/tick.m[{2 * robot}]", f"/tick.m[{2 * robot + 1}]", f"/tick.wall_margin[{robot}]"} <= plotted
        assert {f"/tick.multipliers[{20 * robot + row}]" for row in range(5)} <= plotted


def test_the_scene_s_topics_are_the_log_s() -> None:
    topics = set(LAYOUT["configById"]["3D!team"]["topics"])
    own = {channels.SCENE, channels.TEAM_SCENE, channels.P_POSES, channels.M_POSES}
    assert topics == own | {channels.scan_channel(robot) for robot in range(1, 6)}
    assert LAYOUT["configById"]["RosOut!events"]["topicToRender"] == channels.EVENTS


# As @foxglove/studio-base 1.48, the last open source version, declares them.
PLOT_KEYS = {
    *("title", "foxglovePanelTitle", "paths", "minXValue", "maxXValue", "minYValue", "maxYValue"),
    *("showLegend", "legendDisplay", "showPlotValuesInLegend", "showXAxisLabels", "showYAxisLabels"),
    *("isSynced", "xAxisVal", "xAxisPath", "followingViewWidth", "sidebarDimension"),
}
PLOT_REQUIRED = PLOT_KEYS - {
    *("title", "foxglovePanelTitle", "minXValue", "maxXValue", "minYValue", "maxYValue", "xAxisPath"),
    "followingViewWidth",
}
PATH_KEYS = {"value", "enabled", "timestampMethod", "label", "color"}


def test_plots_are_configured_as_the_viewer_declares_them() -> None:
    plots = [config for name, config in LAYOUT["configById"].items() if name.startswith("Plot!")]
    for config in plots:
        assert PLOT_REQUIRED <= set(config) <= PLOT_KEYS
        assert (config["legendDisplay"], config["xAxisVal"]) == ("floating", "timestamp")
        for path in config["paths"]:
            assert {"value", "enabled", "timestampMethod"} <= set(path) <= PATH_KEYS
            assert path["timestampMethod"] == "receiveTime"
    assert set(LAYOUT["configById"]["RosOut!events"]) <= {"searchTerms", "minLogLevel", "topicToRender"}
