"""Compiled kernels: cached by the state of all kernels' sources, and working without a place to cache."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numba
import pytest

import pbrg_mj
from pbrg_mj.kernel import cache_folder, kernel

PACKAGE = Path(pbrg_mj.__file__).parent


def test_numbas_own_setting_is_left_as_it_was():
    before = numba.config.CACHE_DIR

    @kernel
    def double(x):
        return 2 * x

    assert double(21) == 42
    assert before == numba.config.CACHE_DIR


def folder_of(copy: Path) -> str:
    program = "from pbrg_mj.kernel import cache_folder; print(cache_folder())"
    done = subprocess.run([sys.executable, "-c", program], cwd=copy, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_the_folder_changes_with_any_kernel_and_with_nothing_else(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "pbrg_mj", ignore=shutil.ignore_patterns("__pycache__"))
    before = folder_of(tmp_path)
    assert Path(before).name == cache_folder().name
    plain = tmp_path / "pbrg_mj" / "errors.py"
    plain.write_text(plain.read_text() + "\n# a comment\n")
    assert folder_of(tmp_path) == before
    compiled = tmp_path / "pbrg_mj" / "perception" / "angles.py"
    compiled.write_text(compiled.read_text() + "\n# a comment\n")
    assert folder_of(tmp_path) != before


def test_the_environment_chooses_the_place(monkeypatch, tmp_path):
    cache_folder.cache_clear()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert cache_folder().parent == tmp_path
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    cache_folder.cache_clear()
    assert cache_folder().parent == tmp_path / "user" / "pbrg-mj"
    monkeypatch.undo()
    cache_folder.cache_clear()


def test_without_a_place_to_cache_kernels_still_compile(monkeypatch):
    def refuse(*_, **settings):
        if settings.get("cache"):
            raise RuntimeError("cannot cache function: no locator available")
        return pytest.importorskip("numba").njit

    monkeypatch.setattr("pbrg_mj.kernel.numba.njit", lambda *f, **s: f[0] if f else refuse(**s))

    @kernel
    def triple(x):
        return 3 * x

    assert triple(2) == 6
