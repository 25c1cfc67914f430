"""Which way of drawing is chosen, and that both ways draw the same."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.video import gl, render
from pbrg_mj.video.render import ViewSettings, render_still
from pbrg_mj.video.settings import LAYERS
from tests.needs import need, need_module
from tests.runs import run

av = need_module("av")
VIEW = ViewSettings(size=(320, 180), layers=frozenset(LAYERS) - {"beams"})


@pytest.mark.parametrize(
    ("working", "chosen", "asked"),
    [(("egl", "osmesa"), "egl", ["egl"]), (("osmesa",), "osmesa", ["egl", "osmesa"])],
)
def test_egl_is_chosen_where_it_works_else_osmesa(monkeypatch, working, chosen, asked):
    probed = []
    monkeypatch.setattr(gl, "probe_gl", lambda name: probed.append(name) or {"works": name in working})
    assert gl.working_backend() == chosen
    assert probed == asked


def test_neither_is_one_line_that_names_what_to_install(monkeypatch):
    monkeypatch.setattr(gl, "probe_gl", lambda _name: {"works": False})
    with pytest.raises(InputError, match=r"apt install libegl1 libgl1, or apt install libosmesa6$"):
        gl.working_backend()


def test_what_is_set_outside_does_not_choose(monkeypatch):
    for name in ("MUJOCO_GL", "PYOPENGL_PLATFORM"):
        monkeypatch.setenv(name, "glx")
    surroundings = gl.environment("osmesa")
    assert surroundings["MUJOCO_GL"] == "osmesa"
    assert "PYOPENGL_PLATFORM" not in surroundings


@pytest.mark.render
def test_both_draw_the_same_picture(monkeypatch, tmp_path):
    pictures = []
    for backend, packages in gl.PACKAGES.items():
        need(gl.probe_gl(backend)["works"], f"GL; on Debian: apt install {' '.join(packages)}")
        monkeypatch.setattr(render, "working_backend", lambda backend=backend: backend)
        render_still(run(), tmp_path / f"{backend}.png", VIEW, None)
        with av.open(str(tmp_path / f"{backend}.png")) as container:
            pictures.append(next(container.decode(video=0)).to_ndarray(format="rgb24").astype(float))
    assert pictures[0].std() > 10
    assert np.abs(pictures[0] - pictures[1]).mean() < 1.0
