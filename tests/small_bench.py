"""A small suite, run once, for tests of what is done with its folder."""

from __future__ import annotations

from pathlib import Path

import pytest

import pbrg_mj as pbrg


def small_bench(suite: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run a suite, given as its text; return the folder of the benchmark."""
    folder = tmp_path_factory.mktemp("bench")
    (folder / "given.yaml").write_text(suite)
    return pbrg.bench(folder / "given.yaml", folder / "out", jobs=1).folder
