"""The memory check sees what it is for: every fault planted here goes unnoticed without it."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
from pathlib import Path

import numba
import pytest

import pbrg_mj as pbrg
from pbrg_mj.plugins import IN_SCENARIOS, value_at
from scripts.memory.__main__ import POISONED
from scripts.memory.bundled import RUNS

ROOT = Path(__file__).parents[1]
CHECKED = {"PYTHONMALLOC": "debug", "NUMBA_BOUNDSCHECK": "1"}
WITHOUT_KERNELS = {"none", "cvxpy"}

PLANTED = """
import sys
import numpy as np
from pbrg_mj.kernel import kernel

CORNER = np.dtype([("x", np.float64), ("face", np.int64)])


@kernel
def corners_of(n):
    corners = np.empty(n, CORNER)
    for k in range(n):
        corners[k]["x"], corners[k]["face"] = 1.0, 2
    return corners


@kernel
def x_of(corner):
    return corner["x"] if corner["face"] == 2 else -1.0


@kernel
def freed_record(n):
    corners = corners_of(n)
    corner = corners[n - 1]  # keeps no reference to the array, whose name is not used again
    return x_of(corner)


@kernel
def unwritten_scratch(n):
    return np.empty(n)[n // 2]


@kernel
def index_too_large(n):
    values = np.zeros(n)
    total = 0.0
    for k in range(n + 1):
        total += values[k] * 0.0
    return total


@kernel
def negative_index(n):
    values, total = np.zeros(n + 1)[1:], 0.0
    for k in range(n):
        total += values[k - 1] * 0.0
    return total


def unwritten_array(n):
    np.full(n, 3.0)  # leaves its numbers where the next array of its size will be
    return float(np.empty(n)[n // 2])


if "--poisoned" in sys.argv:
    from scripts.memory.poison import poison_arrays

    poison_arrays()
print(eval(sys.argv[1]))
"""


def planted(tmp_path: Path, call: str, environment: dict[str, str], *options: str) -> subprocess.CompletedProcess[str]:
    program = tmp_path / "planted.py"
    program.write_text(PLANTED)
    clean = {name: value for name, value in os.environ.items() if name not in {*CHECKED, *POISONED}}
    folders = {"PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    command = [sys.executable, str(program), call, *options]
    return subprocess.run(command, env=clean | folders | environment, capture_output=True, text=True)


FRESH = struct.unpack("d", b"\xcd" * 8)[0]  # as Python's allocator fills it


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="kernels are not compiled")
@pytest.mark.parametrize("count", [20, 20_000])
def test_poison_reaches_the_arrays_that_kernels_make(tmp_path: Path, count: int) -> None:
    assert planted(tmp_path, f"unwritten_scratch({count})", POISONED, "--poisoned").stdout == f"{FRESH}\n"


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="kernels are not compiled")
def test_poison_reaches_the_arrays_that_kernels_freed(tmp_path: Path) -> None:
    assert planted(tmp_path, "freed_record(5)", {}).stdout == "1.0\n"
    # Which of the record's numbers are read after it was freed is the optimiser's choice.
    assert float(planted(tmp_path, "freed_record(5)", POISONED, "--poisoned").stdout) not in (1.0, 0.0)


@pytest.mark.parametrize("count", [4, 100, 100_000])  # NumPy's own cache, the heap, pages of their own
def test_poison_reaches_numpys_arrays(tmp_path: Path, count: int) -> None:
    assert planted(tmp_path, f"unwritten_array({count})", POISONED, "--poisoned").stdout == "nan\n"


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="kernels are not compiled")
@pytest.mark.parametrize("fault", ["index_too_large", "negative_index"])
def test_an_index_out_of_range_is_an_error_with_both_switches_alone(tmp_path: Path, fault: str) -> None:
    assert planted(tmp_path, f"{fault}(5)", {}).stderr == ""
    assert "IndexError: index is out of bounds" in planted(tmp_path, f"{fault}(5)", CHECKED).stderr


def test_the_checked_runs_name_every_part_of_scenarios() -> None:
    """Kernels of a governor, certificate or estimator that no run names would go unchecked."""
    scenarios = [pbrg.load(name, overrides).settings for name, overrides in RUNS.values()]
    for kind in IN_SCENARIOS:
        assert {value_at(one, kind.key) for one in scenarios} >= set(kind.built_in) - WITHOUT_KERNELS
    assert {one.estimator.unknown for one in scenarios} == {"free", "closed", "strict"}
    assert {one.plant for one in scenarios} == {"physics", "ideal"}
    assert any(one.sensors.odometry.fuse for one in scenarios) and any(one.drive.pwm_levels for one in scenarios)


def test_the_drawn_worlds_have_every_sensor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "scripts")
    from other_worlds.draw import SENSORS

    from scripts.memory.drawn import drawn_worlds

    drawn = [scenario["sensors"]["beams"]["preset"] for scenario, _ in drawn_worlds().values()]
    assert sorted(drawn) == sorted(SENSORS)
