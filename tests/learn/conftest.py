"""What tests of trainings share."""

import sys
from types import ModuleType

import pytest


@pytest.fixture
def from_standard_input(monkeypatch: pytest.MonkeyPatch) -> None:
    """Meanwhile, the program that runs came from standard input."""
    program = ModuleType("__main__")
    program.__file__ = "<stdin>"
    monkeypatch.setitem(sys.modules, "__main__", program)
