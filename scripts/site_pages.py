"""What the site changes: pages of the project's root join it, and no comment is cut at the edge of a block."""

from __future__ import annotations

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
PAGES = {"README.md": "index.md", "CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md"}
WIDTH = 76  # letters that a block shows at 1,280 pixels
BLOCK = re.compile(r"(?<=^```sh\n)(.*?)(?=^```$)", re.DOTALL | re.MULTILINE)
COMMENTED = re.compile(r"^(\S.*?) +(# .*)$", re.MULTILINE)
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


def on_page_markdown(markdown: str, **_: object) -> str:
    """Where commands with comments behind them are too wide, put the comments above."""
    return BLOCK.sub(lambda block: narrowed(block[1]), markdown)


def narrowed(commands: str) -> str:
    """Lines of commands, each comment above its command where one of them is wider than the block."""
    wide = max(map(len, commands.splitlines()), default=0) > WIDTH
    return COMMENTED.sub(r"\2\n\1", commands) if wide else commands
