"""What is drawn of many beams, the glyphs of the legend, and the scale bar's length."""

from __future__ import annotations

import numpy as np
import pytest

from pbrg_mj.scenario.bundled import data_dir
from pbrg_mj.video.legend import GLYPHS, TILE, glyph_mask, legend_names, scale_length
from pbrg_mj.video.overlay import MOST_BEAMS, drawn_beams
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


def test_glyphs_differ_and_only_what_is_drawn_is_named() -> None:
    masks = [glyph_mask(angles, 17) for angles, _ in GLYPHS.values()]
    assert all(0.15 < mask.mean() < 0.8 for mask in masks)
    assert not np.array_equal(masks[0], masks[1])
    assert len({colour for _, colour in GLYPHS.values()}) == len(GLYPHS)
    made = run()
    assert legend_names(made) == list(GLYPHS)
    without = type(made.optima)(**{name: value[:0] for name, value in vars(made.optima).items()})
    assert "m*" not in legend_names(run(optima=without))


def test_the_floors_squares_are_as_long_as_the_legend_says() -> None:
    arena = (data_dir("models") / "arena.xml").read_text(encoding="utf-8")
    assert 'texrepeat="1 1" texuniform="true"' in arena  # one texture, two by two squares, every two metres
    assert TILE == 1.0
