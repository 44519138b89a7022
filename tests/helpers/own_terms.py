"""Modules with a term of somebody's own, as they are before and after an edit."""

from __future__ import annotations

import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

import pytest

SOURCE = """
from dataclasses import dataclass
import numpy as np
from clearway.reward import Arrival, Reward, Term, Time
from math import floor as rounded, ceil

SHARE = 0.5
ACTIONS = {}
ACTIONS["right"] = 1
ACTIONS.update(left=0)
UNUSED = 1


def share(earned):
    return earned * SHARE


def unused():
    return UNUSED


class Base(Term):
    def halved(self, earned):
        return share(earned)


@dataclass(frozen=True)
class Turning(Base):
    cost: float = 0.005

    def __call__(self, earned, moves):
        return self.halved(earned) - self.cost * (np.arange(4) == ACTIONS["right"]) * rounded(1.5)


REWARD = Reward("few-turns", (Time(), Turning(), Arrival()))

if __name__ == "__main__":
    print(REWARD)
"""
NAME = "own_turning"
DEARER = ("earned) - self", "earned) - 2 * self")
"""An edit of what the term pays."""


def imported(path: Path, patch: pytest.MonkeyPatch, *edits: tuple[str, str], name: str = NAME) -> ModuleType:
    """A module of the source with edits, in a file of that path, as a program that begins now would import it."""
    source = SOURCE
    for old, new in edits:
        assert source.count(old) == 1
        source = source.replace(old, new)
    path.write_text(source)
    spec = spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    patch.setitem(sys.modules, name, module)
    exec(compile(source, path, "exec"), vars(module))  # no compiled file of before
    return module
