"""The comments behind attributes, `p: np.ndarray  # (n, 2) [m]`, as their descriptions in the API reference."""

from __future__ import annotations

import re
from typing import Any

from griffe import Attribute, Docstring, Extension

COMMENT = re.compile(r"\s#\s+(?!noqa|type:|pyright:)(.+)$")


class Comments(Extension):
    """Takes an attribute's comment as its docstring, unless it has one."""

    def on_attribute_instance(self, *, attr: Attribute, **_: Any) -> None:
        """Look behind the attribute's last line."""
        if attr.docstring is None and attr.endlineno is not None:
            lines = attr.lines_collection[attr.filepath]
            comment = COMMENT.search(lines[attr.endlineno - 1])
            if comment:
                attr.docstring = Docstring(comment.group(1), lineno=attr.endlineno, parent=attr)
