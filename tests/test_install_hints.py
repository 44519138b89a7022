"""How errors say that a package is missing: by a command that works here."""

import re
import sys
from pathlib import Path

import pytest

from clearway import errors
from helpers.documents import ROOT


def test_an_extra_is_installed_from_the_clone_by_the_python_that_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/my venv/bin/python")
    assert errors.install_hint("onnx") == f"Install it: '/my venv/bin/python' -m pip install '{ROOT}[onnx]'"


def test_elsewhere_it_asks_for_a_clone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(errors, "__file__", str(tmp_path / "lib/site-packages/clearway/errors.py"))
    assert errors.install_hint("onnx").endswith(" -m pip install '.[onnx]', in a clone of clearway")


def test_no_error_asks_an_index_for_clearway() -> None:
    package = ROOT / "src/clearway"
    named = [
        str(path.relative_to(package))
        for path in package.rglob("*.py")
        if re.search(r"pip install '?clearway", path.read_text())
    ]
    assert named == []
