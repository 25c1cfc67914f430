"""The parts on the page on plug-ins work by name, as its entry points offer them, and as objects, to the same log."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import pbrg_mj as pbrg

PAGE = (Path(__file__).parents[1] / "docs" / "governor.md").read_text(encoding="utf-8")
PARTS = re.search(r"```python\n(# my_parts\.py\n.*?)```", PAGE, re.DOTALL)
ENTRIES = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)[1]
KEYS = {
    "governor.certificate": "scalar_rows",
    "estimator.source": "fence",
    "sensors.noise_model": "gaussian",
    "reference.solver": "bisection",
}


@pytest.fixture
def parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """The page's module, installed with the page's entry points."""
    assert PARTS is not None
    (tmp_path / "my_parts.py").write_text(PARTS[1], encoding="utf-8")
    info = tmp_path / "my_parts-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-parts\nVersion: 1.0\n")
    offered = re.sub(r'\[project\.entry-points\."(.*?)"\]', r"[\1]", ENTRIES).replace('"', "")
    (info / "entry_points.txt").write_text(offered)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield __import__("my_parts")
    sys.modules.pop("my_parts", None)


def test_parts_of_the_page_by_name_and_as_objects(parts: ModuleType) -> None:
    plain = pbrg.load("paper/experiment_near", {"governor.kind": "centralized"}, duration=0.1)
    named = pbrg.run(plain.override(KEYS))
    objects = pbrg.run(
        plain,
        certificate=parts.build_certificate(plain.settings),
        estimator=parts.build_fence(plain.settings),
        noise_model=parts.build_noise(plain.settings),
        reference_solver=parts.build_solver(plain.settings),
    )
    for name in ("q_true_m", "m_m", "half_space_h_m"):
        np.testing.assert_array_equal(named[name], objects[name], err_msg=name)
    G, h = named["half_space_G"][-1], named["half_space_h_m"][-1]
    np.testing.assert_array_equal(G[:, 0], np.tile([1.0, 0.0], (5, 1)))
    np.testing.assert_array_equal(h[:, 0], np.full(5, 2.0))
    r = np.array(plain.settings.operator.reference)
    start = named.optimum.m_star_m[0]
    assert named.metric("span") == objects.metric(parts.span) == {"span_m": float(np.ptp(named.q_true_m[..., 0]))}
    assert np.isfinite(start).all() and np.linalg.norm(start - r) > 0.1
    assert not np.array_equal(named.q_true_m, pbrg.run(plain).q_true_m)
