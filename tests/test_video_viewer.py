"""The window, with a stand-in for MuJoCo's: what it is given, without a display."""

from __future__ import annotations

from contextlib import contextmanager, nullcontext
from pathlib import Path

import mujoco
import mujoco.viewer
import numpy as np
import pytest

from pbrg_mj.cli.main import main
from pbrg_mj.errors import InputError
from pbrg_mj.log.read import run as reader
from pbrg_mj.video import viewer
from tests.runs import run


class Window:
    def __init__(self, model, data, frames):
        self.user_scn = mujoco.MjvScene(model, 1000)
        self.data, self.left, self.seen = data, frames, []
        self.opt = mujoco.MjvOption()

    def is_running(self):
        self.left -= 1
        return self.left >= 0

    def lock(self):
        return nullcontext()

    def sync(self):
        self.seen.append((self.data.body("robot0/robot").xpos.copy(), self.user_scn.ngeom))


def test_the_window_shows_poses_and_marks_of_the_log(monkeypatch):
    windows = []

    @contextmanager
    def launch(model, data, **_options):
        windows.append(Window(model, data, frames=3))
        yield windows[-1]

    monkeypatch.setattr(viewer, "_need_display", lambda: None)
    monkeypatch.setattr(mujoco.viewer, "launch_passive", launch)
    monkeypatch.setattr(viewer, "read_scans", lambda _path, _robots: {})
    made = run()
    viewer.view(made)
    ((place, marks), *others) = windows[0].seen
    np.testing.assert_allclose(place[:2], made.ticks.body_pose_true[0, 0, :2])
    # 2 shades, 2 m_j, 2 targets, a cross of 2, a star of 3, 1 link, 1 half-space of 2; trails come with time
    assert marks >= 14
    assert len(others) == 2


def test_without_a_display_one_line_says_so(monkeypatch):
    for name in viewer.DISPLAYS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(viewer.sys, "platform", "linux")
    with pytest.raises(InputError, match="there is no display to open a window on"):
        viewer.view(run())


def test_a_display_that_does_not_answer_is_told_in_one_line(monkeypatch):
    monkeypatch.setenv("DISPLAY", ":4711")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(InputError, match=r"^no window can be opened on the display \(DISPLAY=:4711\)$"):
        viewer.view(run())


def test_view_is_reached_from_replay_and_not_together_with_verify(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    Path("near.mcap").touch()
    opened = []
    monkeypatch.setattr(reader, "open_run", lambda path: run(path=str(path)))
    monkeypatch.setattr(viewer, "view", opened.append)
    assert main(["replay", "near.mcap", "--view"]) == 0
    assert [one.path for one in opened] == ["near.mcap"]
    assert main(["replay", "near.mcap", "--view", "--verify"]) == 2
    assert "--view and --verify do not go together" in capsys.readouterr().err
