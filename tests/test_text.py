"""Text for people: numbers, and text from files in Markdown, read by a parser of CommonMark."""

import math
from html import escape

import numpy as np
import pytest
from markdown_it import MarkdownIt

from pbrg_mj.text import format_significant, markdown_code, markdown_text

MARKUP = list("ab_*`[]()<>&;\\~!#x1 \"':/.-")


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (263.4, 2, "260"),
        (6019.8, 3, "6020"),
        (99.96, 3, "100"),
        (999.9, 3, "1000"),
        (-0.02941, 3, "-0.0294"),
        (0.0, 2, "0"),
        (1e-5, 2, "1e-05"),
        (1.24e15, 2, "1.2e+15"),
        (math.inf, 2, "inf"),
        (math.nan, 2, "nan"),
    ],
)
def test_large_numbers_have_no_exponent(value: float, digits: int, text: str) -> None:
    assert format_significant(value, digits) == text


def test_the_sign_is_shown_where_asked_for() -> None:
    assert [format_significant(one, 2, "+") for one in (1234.0, 0.5, 0.0, -1234.0)] == ["+1200", "+0.5", "+0", "-1200"]


@pytest.mark.parametrize("value", [1.0, 12.5, 137.0, 2.5e3, 7.77e9])
def test_the_number_is_that_of_the_exponent_form(value: float) -> None:
    assert float(format_significant(value, 3)) == float(f"{value:.3g}")


def test_text_from_files_is_shown_by_markdown_as_it_is() -> None:
    random, parser = np.random.default_rng(64), MarkdownIt("commonmark").enable("strikethrough")
    for _ in range(5000):
        text = "".join(random.choice(MARKUP, random.integers(1, 12))).strip()
        shown = escape(text).replace("&#x27;", "'")
        assert parser.renderInline(markdown_text(text)) == shown
        assert not text or parser.renderInline(markdown_code(text)) == f"<code>{shown}</code>"


def test_names_and_lines_stay_as_they_are() -> None:
    assert markdown_text("paper_flow (centralized), 10 % lost: 0.5") == "paper_flow (centralized), 10 % lost: 0.5"
    assert markdown_text("two\nlines") == "two lines" and markdown_code("two\nlines") == "`two lines`"
