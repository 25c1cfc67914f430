"""What kernels take is told: each member of a tuple by its name, each array by its shape.

Kernels are compiled for positional tuples where named ones cost too much to hand over: only docstrings tell what is in
them. Of a parameter that a kernel unpacks every member must be named; each parameter or member that it indexes by
number, or asks for its length or shape, must be followed by a shape, as in `h (n, K)`; a shape may stand behind several
names, as in `p, xi (n, 2)`. What counts is the kernel's own docstring, those of kernels that it refers to with "as for
`f`", the types that it names, and what the file and the packages around it say for all of their kernels.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "pbrg_mj"
SHAPE = r"\([^()]*,[^()]*\)"
ANOTHER = r"(?:(?:,|,?\s+and|\s+or)\s+`?\w+`?)"  # name in front of the same shape
Documented = ast.FunctionDef | ast.ClassDef | ast.Module


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def is_kernel(function: ast.AST) -> bool:
    return isinstance(function, ast.FunctionDef) and any(
        ast.unparse(one) == "kernel" for one in function.decorator_list
    )


def kernels(module: ast.Module) -> Iterator[ast.FunctionDef]:
    return (one for one in ast.walk(module) if isinstance(one, ast.FunctionDef) and is_kernel(one))


FILES = [path for path in sorted(PACKAGE.rglob("*.py")) if any(kernels(parsed(path)))]


def docstring(node: Documented) -> str:
    return ast.get_docstring(node) or ""


def field_comments(path: Path, one: ast.ClassDef) -> str:
    """The fields of a type and the comments beside them, a line each."""
    lines = path.read_text(encoding="utf-8").splitlines()
    fields = [field for field in one.body if isinstance(field, ast.AnnAssign)]
    return "\n".join(f"{ast.unparse(one.target)} {lines[one.lineno - 1].partition('#')[2]};" for one in fields)


@cache
def types() -> dict[str, str]:
    every = ((path, one) for path in PACKAGE.rglob("*.py") for one in ast.walk(parsed(path)))
    return {one.name: field_comments(path, one) for path, one in every if isinstance(one, ast.ClassDef)}


@cache
def kernels_by_name() -> dict[str, str]:
    return {one.name: docstring(one) for path in FILES for one in kernels(parsed(path))}


def said_for_all(path: Path) -> str:
    """What a file and the packages around it say."""
    packages = [folder / "__init__.py" for folder in path.parents if folder.is_relative_to(PACKAGE)]
    return "\n".join(docstring(parsed(one)) for one in (path, *packages))


def texts(path: Path, kernel: ast.FunctionDef) -> str:
    """Everything that may tell what a kernel takes."""
    own = docstring(kernel)
    if kernel.name.startswith("_"):  # it is read with the others of its file
        own = "\n".join([own, *map(docstring, kernels(parsed(path)))])
    named = [kernels_by_name().get(name, "") for name in re.findall(r"as for `(\w+)`", own)]
    named += [types().get(name, "") for name in re.findall(r"\b[A-Z]\w*[a-z]\w*\b", own)]
    return "\n".join([own, *named, said_for_all(path)])


def names_in(target: ast.expr) -> list[str]:
    if isinstance(target, ast.Tuple):
        return [name for one in target.elts for name in names_in(one)]
    return [target.id] if isinstance(target, ast.Name) and not target.id.startswith("_") else []


def pairs(target: ast.expr, value: ast.expr) -> Iterator[tuple[ast.expr, ast.expr]]:
    """Targets of an assignment with their values, `a, (b, c) = x, y` as `a = x` and `b, c = y`."""
    if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
        for one, its in zip(target.elts, value.elts, strict=True):
            yield from pairs(one, its)
    else:
        yield target, value


def unpacked(kernel: ast.FunctionDef) -> dict[str, list[str]]:
    """Parameters that are unpacked, with the names of their members."""
    parameters, found = {one.arg for one in kernel.args.args}, {}
    for node in ast.walk(kernel):
        if isinstance(node, ast.Assign):
            for target, value in pairs(node.targets[0], node.value):
                if isinstance(target, ast.Tuple) and isinstance(value, ast.Name) and value.id in parameters:
                    found[value.id] = names_in(target)
    return found


def arrays(kernel: ast.FunctionDef) -> set[str]:
    """Names that are indexed by number, or asked for their length or shape."""
    found: set[str] = set()
    for node in ast.walk(kernel):
        asked = None
        if isinstance(node, ast.Subscript):
            field = isinstance(node.slice, ast.Constant) and isinstance(node.slice.value, str)  # of a record
            asked = None if field else node.value
        elif isinstance(node, ast.Attribute):
            asked = node.value if node.attr in ("shape", "size") else None
        elif isinstance(node, ast.Call) and ast.unparse(node.func) == "len":
            asked = node.args[0]
        if isinstance(asked, ast.Name):
            found.add(asked.id)
    return found


def is_named(name: str, text: str) -> bool:
    return re.search(rf"\b{name}\b", text) is not None


def has_shape(name: str, text: str) -> bool:
    return re.search(rf"\b{name}\b`?{ANOTHER}{{0,6}}\s+{SHAPE}", text) is not None


def missing(path: Path, kernel: ast.FunctionDef) -> Iterator[str]:
    """What nobody tells of a kernel's arguments."""
    text, tuples = texts(path, kernel), unpacked(kernel)
    parameters = [one.arg for one in kernel.args.args]
    indexed = arrays(kernel) - set(tuples)
    for parameter, members in tuples.items():
        if has_shape(parameter, text) and not set(members) & indexed:
            continue  # a vector of numbers
        yield from (f"{parameter} has a member {one}" for one in members if not is_named(one, text))
    known = {*parameters, *(one for members in tuples.values() for one in members)}
    yield from (f"{one} has no shape" for one in sorted(indexed & known) if not has_shape(one, text))


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_kernels_tell_what_is_in_their_arguments(path: Path) -> None:
    found = [f"{one.lineno}: {one.name}: {what}" for one in kernels(parsed(path)) for what in missing(path, one)]
    assert not found, "\n".join(found)


PLANTED = '''
@kernel
def area(corners, sizes, numbers, ends):
    """Return an area [m^2]; `corners` (n, 2) [m], `numbers` are scale and offset, `ends` (2,)."""
    width, height = sizes
    scale, offset, exponent = numbers
    low, high = ends
    return len(corners) * width[0] * height
'''


def test_an_untold_member_and_an_array_without_a_shape_are_found() -> None:
    (kernel,) = kernels(ast.parse(PLANTED))
    found = list(missing(PACKAGE / "kernel" / "cache.py", kernel))  # which tells nothing of arrays
    assert found == [
        "sizes has a member width",
        "sizes has a member height",
        "numbers has a member exponent",
        "width has no shape",
    ]
