"""Compiled kernels: cached by what they are compiled from, timed by a clock that leaves compiling out."""

from __future__ import annotations

import gc
import importlib
import math
import os
import pkgutil
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from llvmlite.binding import Linkage, ffi
from numba.core import errors, event, ir
from numba.core.postproc import PostProcessor
from numba.core.runtime import _nrt_python, rtsys

import pbrg_mj
from pbrg_mj.kernel import cache_folder, clock, kernel, watching_compilation
from pbrg_mj.kernel.compiler import IS_TESTED
from pbrg_mj.kernel.decorator import Kernel
from pbrg_mj.kernel.fingerprint import fingerprint
from pbrg_mj.kernel.stopwatch import not_counted
from tests.needs import need_module

compiled = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="kernels are not compiled")

CALLEE = """
from pbrg_mj.kernel import kernel

OFFSET = 10.0


@kernel
def shifted(x):
    return x + OFFSET


@kernel
def unrelated(x):
    return x - 1.0
"""
CALLER = """
from callee import shifted
from pbrg_mj.kernel import kernel, watching_compilation


@kernel
def doubled(x):
    return 2.0 * shifted(x)


seen = []
with watching_compilation(seen.append):
    print(doubled(1.0), [name for name in seen if name])
"""


@pytest.fixture
def project(tmp_path):
    """Return a function that runs a caller with a callee in another file, and says what was printed."""
    (tmp_path / "caller.py").write_text(CALLER)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}
    environment["PYTHONPATH"] = os.pathsep.join([str(Path(pbrg_mj.__file__).parents[1]), str(tmp_path)])

    def python(file: str, **settings: str) -> str:
        command, env = [sys.executable, file], environment | settings
        done = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, check=True)
        return done.stdout.strip()

    def run(callee: str, **settings: str) -> str:
        (tmp_path / "callee.py").write_text(callee)
        return python("caller.py", **settings)

    run.python = python
    return run


@compiled
@pytest.mark.parametrize(
    ("old", "new", "answer"),
    [
        ("x + OFFSET", "x + OFFSET + 1.0", 24.0),  # the code of a function called
        ("OFFSET = 10.0", "OFFSET = 20.0", 42.0),  # a constant that it uses
    ],
)
def test_an_edit_of_a_callee_in_another_file_recompiles_the_caller(project, old, new, answer):
    assert project(CALLEE) == "22.0 ['__main__.doubled']"
    assert project(CALLEE) == "22.0 []"
    assert project(CALLEE.replace(old, new)) == f"{answer} ['__main__.doubled']"
    assert project(CALLEE) == "22.0 []"  # the code before is still there


@compiled
@pytest.mark.parametrize(("old", "new"), [("x - 1.0", "x - 2.0"), ("OFFSET = 10.0", "# a comment\nOFFSET = 10.0")])
def test_an_edit_of_something_else_recompiles_nothing(project, old, new):
    assert project(CALLEE) == "22.0 ['__main__.doubled']"
    assert project(CALLEE.replace(old, new)) == "22.0 []"


@compiled
@pytest.mark.parametrize("setting", ["NUMBA_BOUNDSCHECK", "NUMBA_OPT"])
def test_code_compiled_with_other_settings_is_other_code(project, setting):
    assert project(CALLEE) == "22.0 ['__main__.doubled']"
    assert project(CALLEE, **{setting: "1"}) == "22.0 ['__main__.doubled']"
    assert project(CALLEE, **{setting: "1"}) == "22.0 []"
    assert project(CALLEE) == "22.0 []"


def kernels():
    """Return every kernel of the package; the test that asks is skipped without the extra of environments."""
    need_module("gymnasium")
    modules = [one.name for one in pkgutil.walk_packages(pbrg_mj.__path__, "pbrg_mj.")]
    loaded = [importlib.import_module(name) for name in modules if ".video" not in name and "live" not in name]
    found = [value for module in loaded for value in vars(module).values() if isinstance(value, Kernel)]
    return list({id(one): one for one in found}.values())


@compiled
def test_the_fingerprint_of_every_kernel_can_be_taken():
    assert len(kernels()) > 100
    prints = {fingerprint(one.py_func) for one in kernels()}
    assert len(prints) == len(kernels())


def test_a_kernel_that_uses_what_no_fingerprint_covers_is_refused():
    unknown = object()

    def lost():
        return unknown

    with pytest.raises(TypeError, match="does not know"):
        fingerprint(lost)


def test_the_environment_chooses_the_place(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert cache_folder() == tmp_path
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    assert cache_folder() == tmp_path / "user" / "pbrg-mj"


@compiled
def test_without_a_place_to_cache_kernels_still_compile(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "below"))

    @kernel
    def triple(x):
        return 3 * x

    assert triple(2) == 6


@compiled
def test_what_a_kernel_calls_is_neither_optimised_nor_made_code_of_by_itself():
    @kernel
    def inner(x):
        return x + 1.0

    @kernel
    def outer(x):
        return inner(x) * inner(2.0 * x)

    seen = []

    class Listener(event.Listener):
        def on_start(self, event):
            seen.append(event.data["dispatcher"].__name__)

        def on_end(self, event):
            pass

    with event.install_listener("numba:compile", Listener()):
        assert outer(3.0) == 28.0
    assert seen == ["outer"]
    assert inner(1.0) == 2.0  # and Python may call it all the same
    assert not inner._twin.overloads[(numba.float64,)].library._compiled


@compiled
@pytest.mark.skipif(not IS_TESTED, reason="numba compiles as it does")
def test_only_its_entries_are_seen_outside_a_kernel_s_code():
    @kernel
    def winding(x, parameters):  # too long for its callers
        a, b = parameters
        for _ in range(3):
            x = math.sin(a * x) + math.cos(b * x) + math.tan(a * x) + math.exp(-x * x) + math.log(2.0 + x * x)
            x = math.atan(a * x) + math.sinh(b * x) + math.tanh(a * x) + math.cosh(x) + math.asinh(x + a)
        return x

    @kernel
    def twice(x):
        return winding(winding(x, (0.5, 0.25)), (0.25, 0.5))

    assert twice(1.0) == pytest.approx(twice.py_func(1.0), rel=1e-12)
    (compiled_kernel,) = twice.overloads.values()
    defined = [one for one in compiled_kernel.library._final_module.functions if not one.is_declaration]
    assert any("winding" in one.name for one in defined)
    assert all("twice" in one.name for one in defined if one.linkage != Linkage.internal)


@compiled
@pytest.mark.skipif(not IS_TESTED, reason="numba compiles as it does")
def test_a_constant_that_is_an_argument_is_no_type_of_its_own():
    @kernel
    def scaled(x, pair):
        factor, power = pair
        return factor * x**power

    @kernel
    def outer(x, n):
        return scaled(x, (2, 1)) + scaled(x, (3, 2)) + scaled(x, (n, n))

    assert outer(2.0, 1) == 2.0 * 2.0 + 3.0 * 4.0 + 2.0
    assert len(scaled._twin.overloads) == 1


@compiled
@pytest.mark.skipif(not IS_TESTED, reason="numba compiles as it does")
def test_numba_is_as_it_was_after_a_kernel_that_cannot_be_compiled():
    @kernel
    def wrong(x):
        return x.nothing

    def state():
        return ir.Loc.strformat, errors.WarningsFixer.catch_warnings, list(ffi.lib._lock._cblist), PostProcessor.run

    before = state()
    with pytest.raises(errors.TypingError, match=r'File ".*test_kernel\.py", line \d+'):
        wrong(1.0)
    assert state() == before


@compiled
def test_errors_of_inner_functions_arrive():
    @kernel
    def inverse(x):
        return 1.0 / x

    @kernel
    def outer(x):
        return inverse(x) + 1.0

    assert outer(2.0) == 1.5
    with pytest.raises(ZeroDivisionError):
        outer(0.0)


@compiled
def test_arrays_made_in_inner_functions_are_freed():
    @kernel
    def make(n):
        return np.ones(n)

    @kernel
    def total(n):
        return make(n).sum() + make(n)[1]

    rtsys.initialize(total.targetctx)
    _nrt_python.memsys_enable_stats()
    total(10)
    before = rtsys.get_allocation_stats()
    assert total(1000) == 1001.0
    after = rtsys.get_allocation_stats()
    assert after.alloc - before.alloc == after.free - before.free


@compiled
def test_compiling_is_reported_and_stops_the_clock(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))  # nothing is compiled yet

    @kernel
    def quarter(x):
        return x / 4

    seen, now = [], [0.0]
    monkeypatch.setattr("pbrg_mj.kernel.stopwatch.perf_counter", lambda: now[0])
    before = clock()

    def watch(name):
        seen.append(name)
        now[0] += 10.0  # compiling takes its time

    with watching_compilation(watch):
        quarter(1.0)
    assert [name is None for name in seen] == [False, True]
    assert seen[0].endswith("test_kernel.quarter")
    assert (now[0], clock() - before) == (20.0, 0.0)
    with watching_compilation(seen.append):
        quarter(2.0)
    assert len(seen) == 2
    assert gc.isenabled()


def test_the_clock_stands_still_once_for_nested_contexts(monkeypatch):
    ticks = iter([100.0, 1.0, 2.0, 4.0, 100.0])  # clock, outer, inner, outer's end, clock
    monkeypatch.setattr("pbrg_mj.kernel.stopwatch.perf_counter", lambda: next(ticks))
    before = clock()
    with not_counted(), not_counted():
        pass
    assert clock() == before - 3.0


@compiled
def test_a_copy_of_the_package_shares_the_cache(tmp_path):
    shutil.copytree(Path(pbrg_mj.__file__).parent, tmp_path / "pbrg_mj", ignore=shutil.ignore_patterns("__pycache__"))
    program = "from pbrg_mj.kernel.fingerprint import fingerprint; from pbrg_mj.perception.perceive import "
    program += "perceive_scans; print(fingerprint(perceive_scans.py_func))"
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)
    from pbrg_mj.perception.perceive import perceive_scans

    assert done.stdout.strip() == fingerprint(perceive_scans.py_func)


OF_A_TYPE = """
import numpy as np

from TYPES import Pair
from pbrg_mj.kernel import kernel


@kernel
def total(pair):
    return pair.a + pair.b


if __name__ == "__main__":
    print(total(Pair(1.0, 2.0)))
"""
PAIR = """
from typing import NamedTuple


class Pair(NamedTuple):
    a: float
    b: float
"""


@compiled
def test_a_kernel_whose_argument_s_type_has_moved_is_compiled_again(project, tmp_path):
    """The cache's index names the type by its module, which there is no more."""
    (tmp_path / "program.py").write_text(OF_A_TYPE.replace("TYPES", "earlier"))
    (tmp_path / "earlier.py").write_text(PAIR)
    assert project.python("program.py") == "3.0"
    assert list((tmp_path / "cache").glob("*total*"))
    (tmp_path / "earlier.py").rename(tmp_path / "later.py")
    (tmp_path / "program.py").write_text(OF_A_TYPE.replace("TYPES", "later"))
    for _ in range(2):
        assert project.python("program.py") == "3.0"


WITH_ANOTHER_NUMBA = """
import sys

import numba
import numpy as np

numba.__version__ = "0.99.1"

from caller import doubled, seen
from pbrg_mj.vehicle.hand_point import hand_point

print(doubled(2.0), hand_point(np.array([[1.0, 2.0, 0.0]]), 0.5).tolist(), seen)
print([name for name in sys.modules if name.startswith("pbrg_mj.kernel.pipeline")])
"""


@compiled
def test_with_a_numba_never_tested_kernels_compile_as_it_does_by_default(project, tmp_path):
    assert project(CALLEE) == "22.0 ['__main__.doubled']"  # code of the numba there is, in the same cache
    (tmp_path / "another.py").write_text(WITH_ANOTHER_NUMBA)
    for seen in ("['caller.doubled', None]", "[]"):  # compiled, then read from the cache
        done = project.python("another.py")
        assert done.splitlines()[-2:] == [f"24.0 [[1.5, 2.0]] {seen}", "[]"]
