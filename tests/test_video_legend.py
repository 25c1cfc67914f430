"""What is drawn of many beams, the glyphs of the legend, and the scale bar's length."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.log.read.run import Run
from pbrg_mj.log.read.scans import ScanSeries
from pbrg_mj.scenario.bundled import data_dir
from pbrg_mj.video.glyphs import GLYPHS, LAYER, glyph_picture, legend_names
from pbrg_mj.video.legend import TILE, scale_length
from pbrg_mj.video.overlay import MOST_BEAMS, drawn_beams
from pbrg_mj.video.settings import LAYERS, RenderTask
from tests.runs import run


@pytest.mark.parametrize("count", [1, 2, 24, 36, 37, 72, 360, 1080])
def test_at_most_36_beams_of_a_robot_are_drawn_evenly_spaced(count: int) -> None:
    drawn = np.arange(count)[drawn_beams(count)]
    assert 1 <= len(drawn) <= MOST_BEAMS
    assert len(drawn) == count or len(drawn) > MOST_BEAMS / 2
    assert len(set(np.diff(drawn))) <= 1


@pytest.mark.parametrize(
    ("width", "length"), [(5.0, 1.0), (9.9, 1.0), (10.0, 2.0), (24.0, 2.0), (25.0, 5.0), (0.4, 0.05)]
)
def test_a_scale_bar_has_a_round_length_of_at_most_a_fifth(width: float, length: float) -> None:
    assert scale_length(width) == pytest.approx(length)


def task(made: Run, layers: tuple[str, ...] = LAYERS, scans: dict[int, ScanSeries] | None = None) -> RenderTask:
    scans = {0: ScanSeries(*[np.zeros(1)] * 3)} if scans is None else scans
    return RenderTask(made, scans, "top", (640, 360), frozenset(layers), made.ticks.time)


def test_glyphs_differ() -> None:
    pictures = [glyph_picture(glyph, 17) for glyph in GLYPHS.values()]
    assert all(0.05 < mask.mean() < 0.9 for mask, _ in pictures)
    looks = {np.where(mask[..., None], colour, -1.0).tobytes() for mask, colour in pictures}
    assert len(looks) == len(GLYPHS)


def test_the_legend_names_every_layer_that_is_drawn_and_no_other() -> None:
    made = run()
    assert legend_names(task(made)) == list(GLYPHS)
    assert set(LAYER.values()) == set(LAYERS) - {"text"}
    for layer in ("references", "half_spaces", "beams", "trails", "formation"):
        named = legend_names(task(made, layers=(layer, "text")))
        assert named and all(LAYER[name] == layer for name in named)
    assert "beam" not in legend_names(task(made, scans={}))
    without = type(made.optima)(**{name: value[:0] for name, value in vars(made.optima).items()})
    assert "m*" not in legend_names(task(run(optima=without)))
    blind = run(ticks={"half_space_active": np.zeros_like(made.ticks.half_space_active)})
    assert "half-space" not in legend_names(task(blind))


def test_the_floors_squares_are_as_long_as_the_legend_says() -> None:
    arena = (data_dir("models") / "arena.xml").read_text(encoding="utf-8")
    assert 'texrepeat="1 1" texuniform="true"' in arena  # one texture, two by two squares, every two metres
    assert TILE == 1.0
