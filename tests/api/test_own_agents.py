"""Agents that have no run: one's own, named ones and exported ones, alone and beside a run."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import clearway
from clearway.agents.by_pose import RandomWalk, shortest_paths
from clearway.agents.named import AGENTS
from clearway.errors import AgentError, ArgumentError
from clearway.plugins import BUILT_IN
from clearway.scenes.actions import Action
from clearway.scenes.scene import Scene
from clearway.world.world import make_world
from helpers.made import corridor_scene, grid_scene

SHORT = {"episodes": 2, "step_limit": 30}


class Turner:
    """Turns right and remembers how often; sees pictures of ten pixels."""

    sees = ("rgb",)

    def __init__(self, world: object) -> None:
        self.shapes: set[tuple[int, ...]] = set()

    def reset(self, target, seed):
        return {"turns": np.zeros(len(seed), np.int64)}

    def act(self, observation, state):
        assert set(observation) == {"rgb"}
        self.shapes.add(observation["rgb"].shape[1:])
        turns = state["turns"] + 1
        return clearway.Decisions(np.full(len(turns), int(Action.TURN_RIGHT))), {"turns": turns}


def small_grid() -> Scene:
    return grid_scene(1, width=4, depth=3, picture_size=(10, 10), feature_count=8)


@pytest.fixture
def scene() -> Scene:
    return small_grid()


@pytest.fixture
def module(tmp_path: Path, monkeypatch) -> Iterator[None]:
    (tmp_path / "their_agents.py").write_text(
        "import numpy as np\n"
        "from clearway.agents.by_pose import RandomWalk\n"
        "walk = lambda world: RandomWalk()\n"
        "class Broken:\n    def __init__(self, world):\n        raise KeyError('map')\n"
        "nothing = lambda world: 3\n"
        "number = 4\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    yield
    sys.modules.pop("their_agents", None)


def names(result: clearway.EvaluateResult) -> list[str]:
    return [evaluation.agent for evaluation in result.evaluations]


def test_an_agent_of_ones_own_is_evaluated_on_scenes_and_targets(scene) -> None:
    result = clearway.evaluate(Turner, scene, targets=[5, 22], **SHORT)
    assert names(result) == ["Turner", "random", "shortest path"]
    assert type(result.agent) is Turner and result.agent.shapes == {(10, 10, 3)}
    assert result.figures["collisions"] == 0 and result.evaluations[0].average.target_count == 2
    agent = Turner(None)
    assert clearway.evaluate(agent, scene, targets=[5, 22], **SHORT).agent is agent
    assert agent.shapes == {(10, 10, 3)}


def test_an_agent_itself_will_do(scene) -> None:
    result = clearway.evaluate(RandomWalk(), scene, targets=[5], **SHORT)
    own, theirs = (evaluation.average.values for evaluation in result.evaluations[:2])
    assert dict(own) == dict(theirs)  # the same walk as the random walk that stands beside


def test_agents_stand_beside_a_run(scene, module) -> None:
    run = clearway.train(scene, targets=[5], frames=400, envs=10, rollout_steps=8, width=16)
    beside = {"turner": Turner, "best": "shortest path", "their_agents:walk": "their_agents:walk"}
    result = clearway.evaluate(run, beside=beside, **SHORT)
    assert names(result)[-5:] == [*beside, "random", "shortest path"]
    best, shortest = (e.average.values for e in result.evaluations if e.agent in ("best", "shortest path"))
    assert dict(best) == dict(shortest)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("no-such", "unknown. Use one of random, shortest path, or package.module:name"),
        ("their_agents:absent", "cannot be loaded .AttributeError"),
        ("their_agents:number", "is 4, expected a class or function that takes a World"),
        ("their_agents:Broken", "cannot be made .KeyError: 'map'"),
        ("their_agents:nothing", "gives 3, expected an object with sees, reset and act"),
    ],
)
def test_what_is_no_agent_is_refused_in_one_line(scene, module, name, words) -> None:
    run = clearway.train(scene, targets=[5], frames=80, envs=10, rollout_steps=8, width=16)
    with pytest.raises(AgentError, match=words) as caught:
        clearway.evaluate(run, beside=[name], **SHORT)
    assert "\n" not in str(caught.value)


def test_an_agent_that_sees_what_is_not_there_is_named(scene) -> None:
    class Deep(Turner):
        sees = ("depth",)

    with pytest.raises(clearway.ClearwayError, match="no depth"):
        clearway.evaluate(Deep, scene, **SHORT)

    class Seven(Turner):
        def act(self, observation, state):
            return clearway.Decisions(np.full(len(state["turns"]), 7)), state

    with pytest.raises(AgentError, match="Seven: the agent gave action 7, expected 0 to 3"):
        clearway.evaluate(Seven, scene, **SHORT)


def test_what_an_agent_raises_and_a_state_without_rows_are_told_in_one_line(scene) -> None:
    class Failing(Turner):
        def act(self, observation, state):
            raise KeyError("a map")

    class Forgetful(Turner):
        def act(self, observation, state):
            return super().act(observation, state)[0], {"turns": np.zeros(3, np.int64), "name": "x"}

    with pytest.raises(AgentError, match=r"Failing: agent: failed .KeyError: 'a map'."):
        clearway.evaluate(Failing, scene, **SHORT)
    with pytest.raises(AgentError, match=r"Failing: agent: failed .KeyError: 'a map'."):
        clearway.evaluate(Failing(make_world([scene], {scene.name: [5]})), scene, targets=[5], **SHORT)
    with pytest.raises(
        AgentError, match=r"Forgetful: the agent's state has 'turns' of shape .3,., expected .10, \.\.\.."
    ):
        clearway.evaluate(Forgetful, scene, **SHORT)


def test_an_agent_made_for_other_targets_is_refused_in_one_line(scene) -> None:
    other, small = make_world([scene], {"grid": [5]}), make_world([corridor_scene(2)], {"corridor": [0]})
    for world in (other, small):
        with pytest.raises(AgentError, match="PoseAgent: the agent was made for a world without target 22") as caught:
            clearway.evaluate(shortest_paths(world), scene, targets=[22], **SHORT)
        assert "\n" not in str(caught.value)


def test_wrong_arguments_are_refused(scene) -> None:
    with pytest.raises(ArgumentError, match="the agent has no run that names them"):
        clearway.evaluate(Turner)
    with pytest.raises(ArgumentError, match=r"agent=3: expected a run folder, an \.onnx file"):
        clearway.evaluate(3, scene)
    with pytest.raises(ArgumentError, match="beside='random': expected names"):
        clearway.evaluate(Turner, scene, beside="random")
    run = clearway.train(scene, targets=[5], frames=80, envs=10, rollout_steps=8, width=16)
    with pytest.raises(ArgumentError, match="a run has its own"):
        clearway.evaluate(run, targets=[5])


def test_the_named_agents_are_those_that_there_are() -> None:
    assert BUILT_IN["agents"] == tuple(AGENTS)
    assert AGENTS["shortest path"] is shortest_paths


@pytest.fixture(scope="module")
def exporting(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scene, a run on it and its exported agent."""
    from clearway.deploy.export import export_onnx
    from clearway.deploy.from_run import load_run_in_scene
    from clearway.scenes.thor_v1 import write_scene

    folder = tmp_path_factory.mktemp("exporting")
    write_scene(small_grid(), folder / "grid.h5")
    clearway.train(folder / "grid.h5", targets=[5, 22], frames=400, envs=10, width=16, out=folder / "run")
    export_onnx(load_run_in_scene(folder / "run"), folder / "agent.onnx", with_encoder=False)
    return folder


def test_the_scene_of_an_exported_agent_is_asked_for(exporting: Path) -> None:
    exported = clearway.evaluate(exporting / "agent.onnx", exporting / "grid.h5", **SHORT)
    itself = clearway.evaluate(exporting / "run", **SHORT)
    assert names(exported)[:3] == ["grid"] * 3
    for own, theirs in zip(exported.evaluations[:3], itself.evaluations[:3], strict=True):
        assert dict(own.average.values) == dict(theirs.average.values)
        assert own.protocol == theirs.protocol
    with pytest.raises(ArgumentError, match="the agent is for scene grid, given corridor"):
        clearway.evaluate(exporting / "agent.onnx", corridor_scene(5, feature_count=8), **SHORT)
    with pytest.raises(ArgumentError, match="the agent is for scene grid, given corridor"):
        clearway.evaluate(exporting / "agent.onnx", corridor_scene(5, feature_count=8), targets=[3], **SHORT)


def test_features_that_an_exported_agent_does_not_see_are_refused(exporting: Path) -> None:
    """Else it would walk by numbers that mean something else, and nobody would be told."""
    seen = clearway.load_scene(exporting / "grid.h5")
    assert seen.encoder is not None
    others = {
        "has 5 features": replace(seen, features=np.asarray(seen.features)[:, :5]),
        r"of made-up \(another\)": replace(seen, encoder=replace(seen.encoder, identity="another")),
    }
    for words, other in others.items():
        with pytest.raises(ArgumentError, match=f"{words}.*, the agent sees 8 of made-up .*Encode the scene") as caught:
            clearway.evaluate(exporting / "agent.onnx", other, **SHORT)
        assert "\n" not in str(caught.value)


def test_a_run_folder_is_a_run_whatever_it_is_called(scene, tmp_path: Path) -> None:
    folder = tmp_path / "run.onnx"
    run = clearway.train(scene, targets=[5], frames=80, envs=10, rollout_steps=8, width=16, out=folder)
    assert names(clearway.evaluate(folder, scene, **SHORT)) == names(clearway.evaluate(run, **SHORT))
