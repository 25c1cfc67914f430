"""The gallery's page, videos and script belong together."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

from pbrg_mj.scenario.bundled import bundled_scenarios

SCRIPT = Path(__file__).resolve().parents[1] / "scripts" / "make_gallery.py"


@pytest.fixture(scope="module")
def gallery():
    return runpy.run_path(str(SCRIPT))


def test_page_and_films_are_those_of_the_script(gallery):
    assert list(gallery["findings"]()) == []


def test_every_film_is_of_a_bundled_scenario_and_has_a_name_of_its_own(gallery):
    names = [video.name for video in gallery["VIDEOS"]]
    assert len(set(names)) == len(names)
    assert {video.scenario for video in gallery["VIDEOS"]} <= set(bundled_scenarios())


def test_a_page_by_hand_and_films_too_many_or_too_large_are_found(gallery, monkeypatch, tmp_path):
    inside = gallery["findings"].__globals__
    monkeypatch.setitem(inside, "PAGE", tmp_path / "gallery.md")
    monkeypatch.setitem(inside, "FOLDER", tmp_path)
    (tmp_path / "gallery.md").write_text(gallery["page"]() + "more")
    for video in gallery["VIDEOS"][1:]:
        (tmp_path / f"{video.name}.webp").write_bytes(bytes(10))
    (tmp_path / "old.webp").write_bytes(bytes(inside["LARGEST"] + 1))
    assert sorted(gallery["findings"]()) == [
        f"{gallery['VIDEOS'][0].name}: no video",
        "gallery.md is not what this script writes",
        "old: 1000001 bytes; at most 1000000",
        "old: no scenario",
    ]
