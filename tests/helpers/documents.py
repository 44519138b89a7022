"""Code blocks of Markdown pages, run as a reader would run them, in one folder from top to bottom."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, its text."""

    language: str
    text: str


def code_blocks(page: Path) -> list[Block]:
    """The fenced blocks of a page that begin at the margin."""
    return [Block(language, text) for language, text in BLOCK.findall(page.read_text(encoding="utf-8"))]


def shortened(text: str, changes: Mapping[str, str]) -> str:
    """The text with every change made; each must be of use."""
    for old, new in changes.items():
        assert old in text, f"the page no longer says {old!r}"
        text = text.replace(old, new)
    return text


def run_block(block: Block, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a block of sh or python in a folder, with `clearway` of this checkout on the path."""
    programs = folder / "bin"
    programs.mkdir(exist_ok=True)
    program = programs / "clearway"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m clearway "$@"\n')
    program.chmod(0o755)
    command = {"sh": ["sh", "-euc", block.text], "python": [sys.executable, "-c", block.text]}[block.language]
    paths = {"PATH": f"{programs}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT / "src")}
    return subprocess.run(command, cwd=folder, env=os.environ | paths, capture_output=True, text=True)
