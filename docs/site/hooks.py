"""What the pages need to be a site: README and changelog as pages of it, and pages of the files that they link to.

The pages read well on a code host, too, so their links are relative to where the file lies in the repository.
"""

from __future__ import annotations

import os
import re
from pathlib import Path, PurePosixPath

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[2]
# Files outside docs/ that are pages, and where they stand in the site.
PAGES = {"README.md": "index.md", "CHANGELOG.md": "changelog.md"}
LINK = re.compile(r"(?<=\]\()(?!\w+:|#)([^)\s#]+)")
LANGUAGES = {".py": "python", ".yaml": "yaml", ".toml": "toml", ".xml": "xml", ".cff": "yaml", ".json": "json"}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that do not lie in docs/."""
    for path, uri in PAGES.items():
        files.append(File.generated(config, uri, content=(ROOT / path).read_text(encoding="utf-8")))
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
