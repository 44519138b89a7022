"""An algorithm of another package: Q-learning with changes of one's choice."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from helpers.plugin_package import write_package

PACKAGE, NAME = "odd-learner", "odd"
SOURCE = "algorithm odd of the package odd-learner 1.2"
HEAD = """
from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Literal

import torch

import clearway
from clearway.learn.q_learning import QLearning, TableTrainer, TrainedTable

if TYPE_CHECKING:
    from nowhere import Thing
"""
CLASS = """
@dataclass(frozen=True)
class Odd(QLearning):
    algorithm: ClassVar[str] = "odd"
"""
TRAINER = """
class OddTrainer(TableTrainer):
    {}


@dataclass(frozen=True)
class Odd(QLearning):
    algorithm: ClassVar[str] = "odd"

    def trainer(self, world, reward, seed):
        return OddTrainer(world, self, reward, seed)
"""
OPTIONAL = f"""{CLASS}
    note: str | None = None
    plain: str = "x"
    limit: int | float | None = None
    temperature: float = 1
    style: Literal["plain", "loud"] | None = "plain"
    known: ClassVar[Thing | None] = None
"""
SMALL = {"frames": 400, "envs": 10, "rollout_steps": 8, "step_limit": 30}


def with_body(body: str) -> str:
    """The class with these lines in it."""
    return CLASS + "".join(f"    {line}\n" for line in body.splitlines())


def with_trainer(body: str) -> str:
    """The class with a trainer that has these lines in it."""
    return TRAINER.format(body.replace("\n", "\n    "))


def offer_algorithm(folder: Path, monkeypatch: pytest.MonkeyPatch, source: str) -> Path:
    """Have the package on this process's path until the test ends, or `forget_algorithm` is called."""
    site = write_package(
        folder / "site",
        package=PACKAGE,
        module=HEAD + source,
        entry_points=f"[clearway.algorithms]\n{NAME} = odd_learner:Odd\n",
    )
    monkeypatch.syspath_prepend(str(site))
    monkeypatch.delitem(sys.modules, "odd_learner", raising=False)
    return site


def forget_algorithm(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Take the package away, as if it were uninstalled."""
    monkeypatch.setattr(sys, "path", [place for place in sys.path if place != str(site)])
    sys.modules.pop("odd_learner", None)
