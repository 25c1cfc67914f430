"""The site builds strictly, loads nothing from other hosts, and can be searched when it is read from disk."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import pbrg_mj as pbrg
from tests.browser import PROGRAM, Browser
from tests.needs import need, need_module

need_module("material")
ROOT = Path(__file__).parents[1]
pytestmark = pytest.mark.slow


def build(root: Path, folder: Path) -> tuple[int, str]:
    """Build the site of a checkout and return the exit code and what was said.

    Not with --quiet: it silences the warnings before they are counted, and nothing is an error.
    """
    command = [
        sys.executable,
        "-m",
        "mkdocs",
        "build",
        "--strict",
        "-f",
        root / "docs/site/mkdocs.yml",
        "-d",
        folder,
    ]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    code, output = build(ROOT, folder)
    assert code == 0, output
    return folder


def test_the_reference_describes_protocols_with_the_shapes_of_their_arrays(site):
    page = (site / "api-reference.html").read_text(encoding="utf-8")
    assert "Return this tick's answer and the memory for the next tick" in page
    assert "(n, 2) shifted hand points" in page  # a comment in the code


def test_the_reference_lists_every_public_name():
    page = (ROOT / "docs" / "api-reference.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"^::: pbrg_mj\.(\w+)$", page, re.MULTILINE)) == sorted({*pbrg.__all__} - {"__version__"})


def test_readme_changelog_and_files_of_the_repository_are_pages(site):
    front = (site / "index.html").read_text(encoding="utf-8")
    assert 'href="tutorial.html"' in front
    assert 'href="source/LICENSE.html"' in front
    assert "Unreleased" in (site / "changelog.html").read_text(encoding="utf-8")


BROKEN = {
    "docs/tutorial.md": ("[x](no-such-page.md)", "'no-such-page.md'"),
    "docs/how-to/make-a-video.md": ("[x](../video.md#no-such-heading)", "#no-such-heading"),
    "docs/architecture.md": ("[x](../pbrg_mj/no_such_file.py)", "pbrg_mj/no_such_file.py"),
    "README.md": ("![x](docs/img/no_such_picture.png)", "no_such_picture.png"),
    "docs/page-without-a-place.md": ("# Not in the navigation", "page-without-a-place.md"),
}


def test_what_leads_nowhere_is_an_error(tmp_path):
    copy = tmp_path / "checkout"
    copy.mkdir()
    for path in ROOT.iterdir():
        if path.name not in ("docs", "build", "README.md") and not path.name.startswith(".git"):
            (copy / path.name).symlink_to(path)
    subprocess.run(["cp", "-r", ROOT / "docs", ROOT / "README.md", copy], check=True)
    for file, (broken, _) in BROKEN.items():
        with (copy / file).open("a", encoding="utf-8") as page:
            page.write(f"\n\n{broken}\n")
    code, output = build(copy, tmp_path / "site")
    assert code != 0
    assert [said for _, said in BROKEN.values() if said not in output] == []
    assert f"Aborted with {len(BROKEN)} warnings" in output


@pytest.mark.browser
@pytest.mark.parametrize("name", ["index", "tutorial", "api-reference"])
def test_pages_load_nothing_from_other_hosts(site, name, tmp_path):
    need(PROGRAM, "a Chromium")
    with Browser(tmp_path) as browser:
        browser.open(site / f"{name}.html")
        assert {url.split(":")[0] for url in browser.requests()} <= {"file", "data", "blob"}
        assert browser.complaints() == []


@pytest.mark.browser
def test_the_search_works_from_disk(site, tmp_path):
    need(PROGRAM, "a Chromium")
    with Browser(tmp_path) as browser:
        browser.open(site / "index.html")
        browser.click("input.md-search__input")
        browser.send("Input.insertText", text="terminal gap law")
        browser.press(" ", code=32)
        browser.until("document.querySelectorAll('.md-search-result__link').length > 2")
        found = browser.evaluate("[...document.querySelectorAll('.md-search-result__link')].map((link) => link.href)")
        assert any("paper.html" in link for link in found), found


def test_no_page_names_another_host_for_scripts_styles_or_pictures(site):
    loaded = re.compile(r"<(?:script|link|img|iframe)[^>]*\b(?:src|href)=\"?(https?:)?//", re.IGNORECASE)
    assert [path.name for path in site.rglob("*.html") if loaded.search(path.read_text(encoding="utf-8"))] == []
