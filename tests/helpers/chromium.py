"""A headless Chromium for tests of pages; skipped where there is none."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Playwright

CHROMIUM_VARIABLE = "CLEARWAY_CHROMIUM"
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
ARGUMENTS = (
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


def chromium(own: str) -> str:
    """Path of a Chromium: the one named by the variable, one of the system, or playwright's own."""
    named = os.environ.get(CHROMIUM_VARIABLE)
    if named:
        return named
    installed = [path for path in map(shutil.which, NAMES) if path]
    if installed:
        return installed[0]
    if Path(own).exists():
        return own
    pytest.skip(f"no Chromium found: install one, or name it in ${CHROMIUM_VARIABLE}")


def launched(playwright: Playwright) -> Browser:
    """The browser, without a window."""
    path = chromium(playwright.chromium.executable_path)
    return playwright.chromium.launch(executable_path=path, args=list(ARGUMENTS))
