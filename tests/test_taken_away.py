"""The generalist without its memory, and without its map's cells, as benchmarks take them away."""

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clearway.agents.agent import Decisions

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


@pytest.fixture
def taken(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    monkeypatch.syspath_prepend(BENCHMARKS)
    return runpy.run_path(str(BENCHMARKS / "taken_away.py"))


class Counts:
    """Acts by how many steps it has taken."""

    sees = ("features",)

    def reset(self, target: Any, seed: np.ndarray) -> dict[str, np.ndarray]:
        return {"steps": np.zeros(len(seed), np.int64)}

    def act(self, observation: Any, state: Any) -> tuple[Decisions, dict[str, np.ndarray]]:
        return Decisions(state["steps"]), {"steps": state["steps"] + 1}


def test_who_forgets_takes_every_step_as_the_first(taken: dict[str, Any]) -> None:
    forgetful = taken["Forgetful"](Counts())
    state = forgetful.reset({}, np.arange(2))
    for _ in range(3):
        decisions, state = forgetful.act({}, state)
        assert decisions.action.tolist() == [0, 0]
    assert forgetful.sees == ("features",)
