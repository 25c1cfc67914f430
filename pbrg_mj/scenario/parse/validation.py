"""Plain data to a Scenario. Pydantic finds what is wrong; the words are ours."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from pydantic import ValidationError

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.checks.certificate import guard
from pbrg_mj.scenario.checks.check import check
from pbrg_mj.scenario.checks.physics import stable_step
from pbrg_mj.scenario.checks.plug_ins import plug_ins
from pbrg_mj.scenario.checks.presets import earlier_preset
from pbrg_mj.scenario.diagnostics import Diagnostic, KeyPath, dotted_key, yaml_text
from pbrg_mj.scenario.parse.document import Document
from pbrg_mj.scenario.parse.set_ups import SET_UP, SET_UPS
from pbrg_mj.scenario.schema import Scenario, Section
from pbrg_mj.scenario.schema.describe import describe_at, describe_field, keys, section_at

AnySection = TypeVar("AnySection", bound=Section)


def build(document: Document, file: str, to_run: bool = True) -> Scenario:
    """Return the scenario that a document holds.

    Parts of other packages must be installed and their options fit, and physics step, guard and preset must be today's,
    unless `to_run` is false: of an earlier run it is enough that they were then. Raises InputError with file, line and
    key of the first thing that is wrong.
    """
    scenario = read_section(Scenario, document.data, document, file)
    diagnostics = [*check(scenario)]
    if to_run:
        diagnostics += [*plug_ins(scenario), *stable_step(scenario), *guard(scenario), *earlier_preset(document.data)]
    if diagnostics:
        raise first_error(diagnostics, document, file)
    return scenario


def read_section(kind: type[AnySection], data: Any, document: Document, file: str) -> AnySection:
    """Return the section of that kind that `data`, the document's or a part of it from the top, hold.

    Raises InputError with file, line and key of the first key that is wrong by itself.
    """
    try:
        # Strict: neither `true` nor "1" is a number. By alias: a wall has `from` and `to`, no second spelling.
        return kind.model_validate(_tuples(data), strict=True, by_alias=True, by_name=False)
    except ValidationError as error:
        raise first_error(_diagnostics(error, data, kind), document, file) from None


def first_error(diagnostics: Sequence[Diagnostic], document: Document, file: str) -> InputError:
    """Return the error that reports the first diagnostic, and how many more there are: its `others`.

    First are those that an override caused, then those of the file in the order of its lines.
    """
    origins = [origin(diagnostic.path, document) for diagnostic in diagnostics]
    found = sorted(zip(diagnostics, origins, strict=True), key=lambda one: 0 if isinstance(one[1], str) else one[1])
    (diagnostic, where), *rest = found
    first = _error(diagnostic, where, file, f" (and {len(rest)} more)" if rest else "")
    first.others = tuple(_error(diagnostic, where, file) for diagnostic, where in rest)
    return first


def _error(diagnostic: Diagnostic, where: int | str, file: str, more: str = "") -> InputError:
    """Return the error that reports a diagnostic: of a line of the file, or of an override."""
    key = dotted_key(diagnostic.path)
    if isinstance(where, str):
        return InputError(f"{diagnostic.message}; set by override {yaml_text(where)}{more}", key=key)
    return InputError(diagnostic.message + more, file=file, line=where, key=key)


def origin(path: KeyPath, document: Document) -> int | str:
    """Return where the entry came from, or the nearest section around it when it stands nowhere itself."""
    for length in range(len(path), -1, -1):
        if path[:length] in document.origins:
            return document.origins[path[:length]]
    return 1


def _tuples(data: Any) -> Any:
    """Return the data with tuples for lists: what strict validation takes for a tuple."""
    if isinstance(data, dict):
        return {key: _tuples(value) for key, value in data.items()}
    return tuple(map(_tuples, data)) if isinstance(data, list) else data


def _diagnostics(error: ValidationError, data: Any, root: type[Section]) -> list[Diagnostic]:
    """Return pydantic's errors, unknown keys first, one a place and only the innermost, in our words."""
    items = error.errors(include_url=False, include_context=False, include_input=False)
    unknown = [_locate(item["loc"], data)[0] for item in items if item["type"] == "extra_forbidden"]
    # A key that is misspelt is not missing as well.
    meant = {(*loc[:-1], _nearest(loc, root)) for loc in unknown}
    found: dict[KeyPath, Diagnostic] = {loc: Diagnostic(loc, _unknown(loc, root)) for loc in unknown}
    for item in items:
        if item["type"] == "missing" and item["loc"] in meant:
            continue
        if item["type"] != "extra_forbidden":
            diagnostic = _diagnostic(item, data, root)
            found.setdefault(diagnostic.path, diagnostic)
    outer = {path[:length] for path in found for length in range(len(path))}
    return [diagnostic for path, diagnostic in found.items() if path not in outer]


def _diagnostic(item: Mapping[str, Any], data: Any, root: type[Section]) -> Diagnostic:
    kind, loc = item["type"], item["loc"]
    path, value = _locate(loc, data)
    if kind == "missing" and isinstance(loc[-1], str):
        field = keys(section_at(path, root))[loc[-1]]
        meaning = f" ({field.description})" if field.description else ""
        return Diagnostic((*path, loc[-1]), f"is missing; required: {describe_field(field)}{meaning}")
    if kind == "too_short" and isinstance(path[-1], str):
        meaning = keys(section_at(path[:-1], root))[path[-1]].description
        return Diagnostic(path, f"is empty; allowed: {describe_at(path, root)} ({meaning})")
    if kind == "too_long" and isinstance(path[-1], str):
        return Diagnostic(path, f"has {len(value)} entries; allowed: {describe_at(path, root)}")
    quoted = isinstance(value, str) and kind in ("float_type", "int_type") and _is_number(value)
    hint = " (a number stands without quotes)" if quoted else ""
    return Diagnostic(path, f"is {yaml_text(value)}; allowed: {describe_at(path, root)}{hint}")


def _locate(loc: tuple[str | int, ...], data: Any) -> tuple[KeyPath, Any]:
    """Return the part of pydantic's location that is in the data, and the value there.

    The rest names members of unions, or entries that are missing.
    """
    path: KeyPath = ()
    for part in loc:
        inner: Any = data if isinstance(data, dict) else {}
        if isinstance(data, list) and isinstance(part, int) and part < len(data):
            path, data = (*path, part), data[part]
        elif part in inner:
            path, data = (*path, part), inner[part]
    return path, data


def _unknown(path: KeyPath, root: type[Section]) -> str:
    if path == (SET_UP,):
        return f"is an override, not a key of a file: --set {SET_UP}={SET_UPS[0]}"
    near = _nearest(path, root)
    return f"is unknown; did you mean `{near}`?" if near else f"is unknown; known: {', '.join(_known(path, root))}"


def _nearest(path: KeyPath, root: type[Section]) -> str | None:
    near = difflib.get_close_matches(str(path[-1]), _known(path, root), n=1)
    return near[0] if near else None


def _known(path: KeyPath, root: type[Section]) -> list[str]:
    return list(keys(section_at(path[:-1], root)))


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
