"""The generalist without its memory, and without its map's cells, as benchmarks take them away."""

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clearway.agents.agent import FEATURES, Agent, Decisions, State
from clearway.agents.generalist import Generalist
from clearway.evaluation.tours import Touring, walk_tour
from clearway.mapping.settings import MappingSettings
from clearway.world.world import make_world
from helpers.made import grid_scene
from helpers.perfect_sight import PerfectSight, seen_perfectly

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
SCENE = seen_perfectly(grid_scene(1, width=6, depth=5, obstacle_share=0.25))
SETTINGS = MappingSettings(side_m=9.0)
TARGET, START = 0, SCENE.state_count - 1


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


def made(kind: type[Generalist], *, sees_cells: bool = True) -> Generalist:
    """A generalist of this kind, as an evaluation makes it fit the scene."""
    sight = PerfectSight(SCENE)
    if not sees_cells:
        sight.stands = lambda features: np.zeros((len(features), 63), np.float32)
    return kind(None, sight, SETTINGS).stepping([SCENE])


@pytest.fixture(scope="module")
def tour() -> State:
    """The explorer's state after a tour on which it has bumped into things and come to some of the room alone."""
    explorer = made(Generalist, sees_cells=False)
    world = make_world([SCENE], {SCENE.name: [TARGET]})
    return walk_tour(world, Touring(explorer.explorer, explorer.after, 40), SCENE, seed=0).state


def begun(agent: Agent) -> State:
    return agent.reset({FEATURES: SCENE.features[[TARGET]]}, np.zeros(1, np.uint64))


def equal(first: State, second: State) -> bool:
    return first.keys() == second.keys() and all(np.array_equal(first[name], second[name]) for name in first)


@pytest.mark.parametrize("toured", [False, True], ids=["unknown room", "toured room"])
def test_who_is_without_memory_holds_at_each_step_what_the_generalist_holds_at_the_first(
    taken: dict[str, Any], tour: State, toured: bool
) -> None:
    kinds = made(Generalist), made(taken["WithoutMemory"])
    world = make_world([SCENE], {SCENE.name: [TARGET]})
    whole, without = (kind.after(tour) if toured else kind.on_poses(world) for kind in kinds)
    first, state, remembered = begun(whole), begun(without), begun(whole)
    here, other = START, 0
    for _ in range(12):
        seen = {FEATURES: SCENE.features[[here]]}
        expected, _ = whole.act(seen, first)
        decisions, state = without.act(seen, state)
        assert (decisions.action, decisions.arrived) == (expected.action, expected.arrived)
        assert equal(state, first), "of a tour the map stays, and of the episode nothing"
        by_memory, remembered = whole.act(seen, remembered)
        other += int(by_memory.action[0] != decisions.action[0])
        following = int(SCENE.graph[here, by_memory.action[0]])
        here = here if following < 0 else following
    assert other, "the generalist does other things by its memory"


def test_who_is_without_cells_knows_the_pictures_of_a_tour_and_no_cell(taken: dict[str, Any], tour: State) -> None:
    whole, without = (begun(made(kind).after(tour)) for kind in (Generalist, taken["WithoutCells"]))
    usual = SETTINGS.usual_room
    assert (whole["room"] > usual).any() and (whole["room"] < usual).any() and whole["shut"].any()
    assert (without["room"] == np.float32(usual)).all() and not without["shut"].any()
    assert np.array_equal(without["mark"], whole["mark"]) and whole["mark"].any(), "the pictures, each in its pose"
    assert np.array_equal(without["goal"], whole["goal"]) and whole["goal"].any(), "where they tell of the target"
