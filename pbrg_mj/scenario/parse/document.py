"""YAML text to plain data that remembers its lines. Knows nothing of scenarios.

Data are built from the parser's node tree, so that nothing but mappings, lists, numbers, true, false, null and text can
come out of a file, whatever its tags say.
"""

from __future__ import annotations

import io
import warnings
from dataclasses import dataclass
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, ReusedAnchorWarning, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from ruamel.yaml.representer import SafeRepresenter

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.diagnostics import KeyPath, dotted_key, yaml_text

MOST_BYTES = 256 * 1024
TOO_LARGE = f"is larger than {MOST_BYTES // 1024} KiB, the most a scenario may be"
MOST_NODES = 100_000  # an alias counts as all that it stands for
DEEPEST = 20
LONGEST_NUMBER = 64  # characters
TAG = "tag:yaml.org,2002:"
# The parser takes dates and `<<` for more than text; no key of a scenario does.
TEXT_TAGS = {TAG + kind for kind in ("str", "timestamp", "merge", "value")}


def _int(text: str) -> int:
    based = text.lstrip("+-")[:2] in ("0x", "0o", "0b")
    return int(text, 0 if based else 10)


def _float(text: str) -> float:
    return float(text.replace(".inf", "inf").replace(".nan", "nan"))


NUMBERS = {"bool": {"true": True, "false": False}.__getitem__, "int": _int, "float": _float}


@dataclass(frozen=True)
class Document:
    """Plain data, and where each entry of it came from: a line counted from 1, or the text of an override."""

    data: Any
    origins: dict[KeyPath, int | str]


def read_document(text: str, file: str) -> Document:
    """Return the data and lines of one YAML 1.2 document.

    Raises InputError with file and line when it is too large, not YAML, holds a key twice or a tag.
    """
    if len(text) > MOST_BYTES:
        raise InputError(TOO_LARGE, file=file)
    builder = _Builder(file)
    root = _compose(text, file)
    return Document(None if root is None else builder.build(root, ()), builder.lines)


def write_document(data: Any) -> str:
    """Return YAML 1.2 text that `read_document` turns into the same data, every float exactly."""
    yaml = YAML(typ="safe", pure=True)
    yaml.Representer = _Representer
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.width = 110
    stream = io.StringIO()
    yaml.dump(data, stream)
    return stream.getvalue()


class _Representer(SafeRepresenter):
    """Writes what the reader reads back as it was."""

    def ignore_aliases(self, data: Any) -> bool:
        return True

    def represent_text(self, text: str) -> Node:
        # Other quotes fold line breaks such as U+0085 into spaces.
        return self.represent_scalar(TAG + "str", text, style=None if text.isprintable() else '"')


_Representer.add_representer(str, _Representer.represent_text)


def _compose(text: str, file: str) -> Node | None:
    try:
        yaml = YAML(typ="safe", pure=True)
        with warnings.catch_warnings():
            warnings.simplefilter("error", ReusedAnchorWarning)
            root = yaml.compose(text)
    except ReusedAnchorWarning:
        raise InputError("is not YAML: an anchor (&name) is there twice; allowed: each name once", file=file) from None
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = _plain(error.problem or error.context or "cannot be read")
        raise InputError(f"is not YAML: {problem}", file=file, line=mark.line + 1 if mark else None) from None
    except YAMLError as error:
        position = getattr(error, "position", 0)
        raise InputError(f"is not YAML: {_plain(str(error))}", file=file, line=_line(text, position)) from None
    except RecursionError:
        raise InputError(f"is nested too deeply; allowed: {DEEPEST} levels", file=file) from None
    if yaml.version not in (None, (1, 2)):
        raise InputError(f"is YAML {yaml_text(yaml.version)}; allowed: YAML 1.2", file=file, line=1)
    return root


def _line(text: str, position: int) -> int:
    return text.count("\n", 0, position) + 1


def _plain(text: str) -> str:
    """Return the first line of a parser's message, with nothing in it that a terminal would act on."""
    first = (text.splitlines() or [""])[0]
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in first)


class _Builder:
    """Turns nodes into data, counting them and keeping their lines."""

    def __init__(self, file: str):
        self.file = file
        self.lines: dict[KeyPath, int | str] = {}
        self.nodes = 0

    def build(self, node: Node, path: KeyPath) -> Any:
        self.lines.setdefault(path, node.start_mark.line + 1)
        self.nodes += 1
        if self.nodes > MOST_NODES:
            raise self.error(path, f"holds more than {MOST_NODES} entries, aliases counted in full")
        if len(path) > DEEPEST:
            raise self.error(path[:3], f"is nested too deeply; allowed: {DEEPEST} levels")
        match node:
            case MappingNode(tag=tag) if tag == TAG + "map":
                return self.mapping(node, path)
            case SequenceNode(tag=tag) if tag == TAG + "seq":
                return [self.build(item, (*path, i)) for i, item in enumerate(node.value)]
            case ScalarNode(tag=tag):
                return self.scalar(node, path)
        raise self.error(path, f"has the tag {yaml_text(str(node.tag))}; tags are not allowed")

    def mapping(self, node: MappingNode, path: KeyPath) -> dict[str, Any]:
        data: dict[str, Any] = {}
        for key_node, value_node in node.value:
            if not isinstance(key_node, ScalarNode):
                raise self.error(path, "has a list or a section for a key; allowed: text")
            key, line = _text(key_node.value), key_node.start_mark.line + 1
            inner = (*path, key)
            if key in data:
                first = self.lines[inner]
                raise InputError(
                    f"is there twice, first in line {first}", file=self.file, line=line, key=dotted_key(inner)
                )
            self.lines[inner] = line
            data[key] = self.build(value_node, inner)
        return data

    def scalar(self, node: ScalarNode, path: KeyPath) -> Any:
        if node.tag in TEXT_TAGS:
            return _text(node.value)
        kind = str(node.tag).removeprefix(TAG)
        if kind == "null":
            return None
        if kind not in ("bool", "int", "float"):
            raise self.error(path, f"has the tag {yaml_text(str(node.tag))}; tags are not allowed")
        if len(node.value) > LONGEST_NUMBER:
            raise self.error(path, f"is a number of more than {LONGEST_NUMBER} characters")
        return self.number(node, path, kind)

    def number(self, node: ScalarNode, path: KeyPath, kind: str) -> bool | int | float:
        try:
            return NUMBERS[kind](node.value.replace("_", "").lower())
        except (ValueError, KeyError):  # an explicit tag such as `!!int north`
            raise self.error(path, f"is {yaml_text(node.value)}, which its tag says is {kind}") from None

    def error(self, path: KeyPath, message: str) -> InputError:
        line = self.lines.get(path)
        return InputError(message, file=self.file, line=line if isinstance(line, int) else None, key=dotted_key(path))


def _text(value: str) -> str:
    """Return text that can be written to a file: an escaped lone surrogate cannot."""
    return value.encode("utf-8", "replace").decode("utf-8")
