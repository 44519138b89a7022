"""Evaluation of a run: what stands beside its agent, and what is said of it."""

import re
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from clearway.agents.agent import Decisions
from clearway.agents.by_pose import RandomWalk
from clearway.errors import RunError
from clearway.evaluation import protocol
from clearway.evaluation.optimum import world_yardsticks
from clearway.evaluation.runs import _optima, evaluate_run, evaluate_runs
from clearway.evaluation.tables import markdown_table
from clearway.learn.load import load_agent
from clearway.learn.run_record import record_of
from clearway.learn.train import train
from clearway.reward import COLLISION_AWARE
from helpers.agents import told_after
from helpers.made import grid_scene
from helpers.small_runs import small_learner, small_request

NAME = "collision-aware, beta -0.5"
SCENE = grid_scene(3, width=9, depth=9, feature_count=12)


def test_an_evaluation_says_what_its_agent_was_trained_with(tmp_path: Path) -> None:
    request = small_request(
        learner=small_learner(frames=160, clip_rewards=True),
        reward=COLLISION_AWARE.with_changes(beta=-0.5),
        zone_level="cell",
    )
    agent = load_agent(train(request, tmp_path / "run").path)
    sampled, *others = evaluate_run(agent, request.scenes, episodes_per_target=1, step_limit=10)
    found = sampled.to_json()["trained"]
    assert found["frames"] == 160 and found["seed"] == 3 and found["zone_level"] == "cell"
    assert found["reward"]["beta"] == -0.5 and found["reward"]["clip"]
    told = f"{NAME}: 160 frames, seed 3, reward alpha -0.01, beta -0.5, gamma -0.011, terminal 10, clipped to "
    assert markdown_table([sampled, *others]).count(f"{told}[-1, 1], zones of cells.") == 1
    assert f"optimum ({NAME})" in [other.agent for other in others]  # not the unclipped one
    assert [other.agent for other in others if other.trained] == [NAME] * 2  # the other ways to choose


def test_an_agent_that_tells_no_probabilities_is_evaluated_as_it_chooses_alone(monkeypatch) -> None:
    shown: list[int] = []

    @contextmanager
    def progress(what: str, total: int, *_: object, **__: object):
        yield shown.append
        assert shown == sorted(shown) and shown[-1] == total  # what is left out counts as done

    monkeypatch.setattr(protocol, "work_progress", progress)

    class Walks(RandomWalk):
        def act(self, observation, state):
            decisions, after = super().act(observation, state)
            return Decisions(decisions.action), after

    request = small_request()
    silent = SimpleNamespace(record=record_of(request), frames=0, on_poses=lambda world: Walks())
    found = evaluate_run(silent, request.scenes, episodes_per_target=2, step_limit=10)
    of_agents = [(one.agent, one.protocol.action_selection) for one in found]
    assert of_agents[0] == ("collision-aware", "sampled") and found[0].trained
    assert [name for name, _ in of_agents].count("collision-aware") == 1
    assert of_agents[-2:] == [("random", "sampled"), ("shortest path", "sampled")]
    assert found[0].average.values == found[-2].average.values  # it is the random walk


def test_runs_of_other_zones_and_names_given_twice_are_refused(tmp_path: Path) -> None:
    requests = [small_request(learner=small_learner(frames=160), zone_level=level) for level in ("pose", "cell")]
    one, other = (load_agent(train(request, tmp_path / request.zone_level).path) for request in requests)
    scenes = requests[0].scenes
    with pytest.raises(RunError, match="the runs differ in the level of their zones"):
        evaluate_runs({"one": one, "other": other}, scenes)
    for name in ("one", "optimum (collision-aware, unclipped)", "random", "shortest path"):
        with pytest.raises(RunError, match=rf"beside: '{re.escape(name)}' is the name of another agent"):
            evaluate_runs({"one": one}, scenes, beside={name: lambda world: RandomWalk()})


@pytest.mark.parametrize("name", ["random", "shortest path", "optimum (collision-aware, unclipped)"])
def test_a_reward_with_the_name_of_a_yardstick_is_refused(name: str, tmp_path: Path) -> None:
    request = small_request(learner=small_learner(frames=160))
    agent = load_agent(train(request, tmp_path).path)
    with pytest.raises(RunError, match=f"the reward '{re.escape(name)}' has the name of a yardstick"):
        evaluate_runs({name: agent}, request.scenes)


def test_the_optimum_is_that_of_the_reward_as_training_paid_it() -> None:
    request = small_request(scenes=[SCENE], targets={SCENE.name: (5, 100)}, learner=small_learner(clip_rewards=True))
    record, world = record_of(request), request.trainer().world
    state = torch.arange(world.state_count)
    target = torch.zeros_like(state)
    policies = []
    for reward in (request.reward, record.reward):
        (exact, _) = world_yardsticks(world, reward)
        policies.append(torch.from_numpy(exact.yardstick.optimal_policy)[state])
    assert not torch.allclose(*policies)
    best = _optima(world, [record.reward])["optimum (collision-aware)"]
    walking = state != world.target_state[0]
    found = told_after(best, world, state[:, None], target)[walking]
    torch.testing.assert_close(found.double(), policies[1][walking], rtol=1e-5, atol=1e-6)
    assert "optimum (collision-aware, unclipped)" in _optima(world, [request.reward])
