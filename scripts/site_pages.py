"""Pages of the site that stand in the project's root: README as the first one, the changelog, how to contribute."""

from __future__ import annotations

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
PAGES = {"README.md": "index.md", "CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md"}
LINK = re.compile(r"(?<=\]\()(?!https?:)([^)#]+)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages, their links as seen from the documents' folder."""
    for source, page in PAGES.items():
        text = LINK.sub(lambda link: linked(link[1]), (ROOT / source).read_text(encoding="utf-8"))
        files.append(File.generated(config, page, content=text))
    return files


def linked(path: str) -> str:
    """A path as seen from the root, as seen from the documents' folder."""
    return PAGES.get(path, path.removeprefix("docs/"))
