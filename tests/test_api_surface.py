"""The public names: all there, documented, and light to import."""

from __future__ import annotations

import ast
import inspect
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import pbrg_mj as pbrg

ROOT = Path(__file__).parents[1]
HEAVY = {"numpy", "scipy", "mujoco", "numba", "cvxpy", "clarabel", "pydantic", "mcap", "matplotlib", "typer", "rich"}


@pytest.mark.parametrize("name", pbrg.__all__)
def test_every_public_name_is_there_and_documented(name):
    one = getattr(pbrg, name)
    if name == "__version__":
        return
    if inspect.isclass(one) or inspect.isfunction(one):
        assert one.__doc__ and one.__doc__.strip(), name
        assert one.__module__.startswith("pbrg_mj.")
    if inspect.isclass(one):
        for member, what in vars(one).items():
            if not member.startswith("_") and (inspect.isfunction(what) or isinstance(what, property)):
                assert inspect.getdoc(what), f"{name}.{member}"


def test_the_package_and_the_page_name_all_of_them():
    page = (ROOT / "docs" / "api-reference.md").read_text(encoding="utf-8")
    for name in set(pbrg.__all__) - {"__version__"}:
        assert f"`{name}`" in pbrg.__doc__, name
        assert f"\n::: pbrg_mj.{name}\n" in page, name


def test_the_three_lists_are_one():
    """What type checkers see, what is imported on demand, and `__all__`."""
    tree = ast.parse(Path(pbrg.__file__).read_text(encoding="utf-8"))
    checked = next(node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
    homes = {
        (alias.asname or alias.name): node.module
        for node in checked.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert homes == pbrg._HOMES
    assert sorted([*homes, "__version__"]) == pbrg.__all__
    assert set(pbrg.__all__) <= set(dir(pbrg))


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="has no attribute 'runn'"):
        _ = pbrg.runn


def test_the_version_is_the_projects():
    assert pbrg.__version__ == tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]


def python(code):
    return subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True).stdout


def test_importing_it_loads_nothing_heavy():
    loaded = python("import sys; import pbrg_mj; print(*sys.modules)").split()
    assert set(loaded) & HEAVY == set()
    assert {name for name in loaded if name.startswith("pbrg_mj")} == {"pbrg_mj", "pbrg_mj.blas_threads"}


def test_a_name_loads_what_it_needs_and_errors_next_to_nothing():
    loaded = python("import sys; from pbrg_mj import InputError; print(*sys.modules)").split()
    assert set(loaded) & HEAVY == set()


def test_importing_it_takes_no_time():
    """It loads less than a handful of modules that an empty program has not, all of Python's own."""
    loaded = python("import sys; before = set(sys.modules); import pbrg_mj; print(*set(sys.modules) - before)").split()
    assert len(loaded) < 40
    assert {name.partition(".")[0] for name in loaded} <= {"pbrg_mj", *sys.stdlib_module_names}
