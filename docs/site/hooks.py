"""What the pages need to be a site: README, changelog and notebooks as pages, and pages of the files that they link to.

The pages read well on a code host, too, so their links are relative to where the file lies in the repository.
"""

from __future__ import annotations

import base64
import json
import os
import re
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[2]
# Files outside docs/ that are pages, and where they stand in the site.
PAGES = {"README.md": "index.md", "CHANGELOG.md": "changelog.md"}
LINK = re.compile(r"(?<=\]\()(?!\w+:|#)([^)\s#]+)")
LANGUAGES = {".py": "python", ".yaml": "yaml", ".toml": "toml", ".xml": "xml", ".cff": "yaml", ".json": "json"}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are not Markdown in docs/."""
    for path, uri in PAGES.items():
        files.append(File.generated(config, uri, content=(ROOT / path).read_text(encoding="utf-8")))
    for file in [file for file in files if file.src_uri.endswith(".ipynb")]:
        files.remove(file)
        for uri, content in _notebook(file.src_uri, json.loads(file.content_string)):
            files.append(File.generated(config, uri, content=content))
    for file in list(files.documentation_pages()):
        for target in LINK.findall(file.content_string):
            path = _in_repository(file.src_uri, target)
            uri = _source_page(path)
            if _is_source(path) and (ROOT / path).is_file() and files.get_file_from_path(uri) is None:
                files.append(File.generated(config, uri, content=_source(path)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn links in the repository into links in the site."""
    here = page.file.src_uri

    def in_site(link: re.Match[str]) -> str:
        path = _in_repository(here, link.group())
        inside = path.startswith("docs/")
        uri = path.removeprefix("docs/") if inside else PAGES.get(path) or _source_page(path)
        uri = re.sub(r"\.ipynb$", ".md", uri)
        return os.path.relpath(uri, PurePosixPath(here).parent)

    return markdown if here.startswith("source/") else LINK.sub(in_site, markdown)


def _in_repository(page: str, target: str) -> str:
    """Return the path in the repository of what a page of the site links to."""
    origin = {uri: path for path, uri in PAGES.items()}.get(page, f"docs/{page}")
    return os.path.normpath(PurePosixPath(origin).parent / target)


def _is_source(path: str) -> bool:
    return not path.startswith("docs/") and path not in PAGES


def _source_page(path: str) -> str:
    return f"source/{path}.md"


def _source(path: str) -> str:
    text = (ROOT / path).read_text(encoding="utf-8").rstrip()
    return f"# {path}\n\n````{LANGUAGES.get(Path(path).suffix, 'text')}\n{text}\n````\n"


def _notebook(uri: str, notebook: dict[str, Any]) -> Iterator[tuple[str, str | bytes]]:
    """Yield the pictures in a notebook's outputs and, last, the notebook as a page, each with where it stands."""
    parts: list[str] = []
    for cell in notebook["cells"]:
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
        for output in cell.get("outputs", ()):
            data = output.get("data", {"text/plain": output.get("text", "")})
            if "image/png" in data:
                name = f"{PurePosixPath(uri).stem}-{len(parts)}.png"
                yield f"{PurePosixPath(uri).parent}/{name}", base64.b64decode(data["image/png"])
                parts.append(f"![The figure that these lines draw]({name})")
            else:
                parts.append(f"```text\n{''.join(data['text/plain']).rstrip()}\n```")
    yield re.sub(r"\.ipynb$", ".md", uri), "\n\n".join(parts)
