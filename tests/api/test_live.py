from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clearway
from clearway import evaluate_live
from clearway.agents.by_pose import RandomWalk
from clearway.agents.generalist import Generalist
from clearway.errors import AgentError, ArgumentError, RunError, SceneError
from clearway.live import goals
from clearway.live.conditions import REFERENCE, Perturbations
from clearway.perception import eyes
from clearway.perception.eyes import write_eyes
from clearway.scenes.actions import Action
from clearway.scenes.aspect import AspectWarning
from clearway.scenes.scene import Provenance
from helpers.made import corridor_scene, grid_scene
from helpers.small_eyes import small_eyes
from helpers.small_live import walkable_live


@pytest.fixture(scope="module")
def live():
    return walkable_live()


@pytest.fixture(scope="module")
def agent(tmp_path_factory) -> Generalist:
    """The generalist, behind eyes that have learnt nothing."""
    folder = tmp_path_factory.mktemp("eyes")
    write_eyes(folder, small_eyes(), {})
    return Generalist.by_eyes(eyes.from_record(eyes.find_record(str(folder))))


@pytest.fixture
def walkable(live, monkeypatch):
    monkeypatch.setattr(goals, "live_room", lambda scene: live)
    return live.scene


def test_it_walks_off_the_grid_and_a_seed_repeats(agent, walkable):
    settings = {"goals": 3, "step_limit": 4}
    (told,) = evaluate_live(agent, walkable, perturb="angle-noise=3", **settings)
    assert told.agent == "generalist" and told.perturbed["label"] == "turn ± 3°"
    assert told.average.episodes == 3 and told.average.false_arrivals is not None
    (again,) = evaluate_live(agent, walkable, perturb=Perturbations(angle_noise=3.0), **settings)
    assert again.to_json() == told.to_json()
    said = []
    (toured,) = evaluate_live(agent, walkable, tour=5, show=said.append, **settings)
    assert toured.tour is not None and toured.tour["steps"] == 5
    assert said[0] == "building walkable" and said[1] == "none: generalist in walkable"


@pytest.mark.slow
def test_a_sweep_walks_every_setting(agent, walkable):
    found = evaluate_live(agent, walkable, goals=2, step_limit=2, sweep=(1.0,))
    labels = [one.perturbed["label"] for one in found]
    assert len(labels) == 10 and labels[0] == "none" and labels[-1] == "all, strength 1"
    assert found[-1].perturbed["perturbations"] == REFERENCE.to_json()


def test_pictures_of_another_aspect_are_warned_of(agent, walkable):
    pictures = walkable.observations[:]
    other = replace(walkable, observations=pictures[:, : pictures.shape[1] // 2])
    with pytest.warns(AspectWarning, match=r"scene walkable: pictures of .* have the aspect"):
        evaluate_live(agent, other, goals=2, step_limit=1)


def test_what_cannot_be_walked_is_one_line(agent, monkeypatch):
    monkeypatch.setattr(Generalist, "shipped", classmethod(lambda kind: agent))
    with pytest.raises(SceneError, match=r"grid: there is no room to walk in: the scene comes from test"):
        evaluate_live("generalist", grid_scene(1), goals=2)
    long = replace(corridor_scene(5), cell_size_m=1.5)
    for walk in (evaluate_live, clearway.evaluate_goals):
        with pytest.raises(SceneError, match=r"corridor: moves of 1\.5 m, and the generalist walks by 0\.2 to 1 m"):
            walk("generalist", long, goals=2)
    built = replace(corridor_scene(5), made_by=Provenance("room", room="bathroom", seed=0), observations=None)
    with pytest.raises(SceneError, match="corridor: has no pictures"):
        evaluate_live("generalist", built, goals=2)
    with pytest.raises(RunError, match=r"runs/x: "):
        evaluate_live("runs/x", corridor_scene(5))
    small = {"frames": 80, "envs": 10, "rollout_steps": 8}
    trained = clearway.train(corridor_scene(5), **small, width=16).agent
    bound = "bound to its rooms, and off the grid goals are drawn anew in any"
    with pytest.raises(ArgumentError, match=f"ppo: {bound}.*clearway evaluate RUN --live, without --goals"):
        evaluate_live(trained, corridor_scene(5))
    table = clearway.train(corridor_scene(5), algorithm="q-learning", **small).agent  # no network, so no --live either
    with pytest.raises(ArgumentError, match=f"q-learning: {bound}.*clearway evaluate RUN without --goals and --live"):
        evaluate_live(table, corridor_scene(5))
    with pytest.raises(ArgumentError, match="sweep sets the perturbations itself"):
        evaluate_live("generalist", corridor_scene(5), perturb="all", sweep=(1.0,))
    for sweep in (0.5, None, "1.0"):
        with pytest.raises(ArgumentError, match="expected a sequence of strengths"):
            evaluate_live("generalist", corridor_scene(5), sweep=sweep)
    for sweep in ((-1.0,), ("x",), (1.0, float("inf")), (1e6,)):
        with pytest.raises(ArgumentError, match="expected shares of the full strengths above 0"):
            evaluate_live("generalist", corridor_scene(5), sweep=sweep)


class Bumper:
    """Walks ahead until the picture stays the same, then turns."""

    sees = ("rgb",)

    def __init__(self, world: object) -> None:
        pass

    def reset(self, target, seed):
        return {"before": np.zeros_like(target["rgb"])}

    def act(self, observation, state):
        stuck = (observation["rgb"] == state["before"]).all((1, 2, 3))
        action = np.where(stuck, Action.TURN_RIGHT, Action.MOVE_FORWARD)
        return clearway.Decisions(action), {"before": observation["rgb"]}


def test_an_agent_of_one_s_own_walks_off_the_grid_by_what_a_camera_gives(walkable):
    settings = {"goals": 3, "step_limit": 6}
    (told,) = evaluate_live(Bumper, walkable, **settings)
    assert told.agent == "Bumper" and told.average.episodes == 3 and told.average.collisions > 0
    for agent in (Bumper(None), lambda world: Bumper(world)):
        (again,) = evaluate_live(agent, walkable, **settings)
        assert again.scenes == told.scenes
    (random,) = evaluate_live(RandomWalk(), walkable, **settings)
    assert random.scenes != told.scenes


@pytest.mark.parametrize(
    ("agent", "words"),
    [
        (
            type("Deep", (Bumper,), {"sees": ("rgb", "depth")}),
            r"Deep: the agent sees depth, and live walks take colour",
        ),
        (type("Sure", (Bumper,), {"act": lambda *_: 1 / 0}), r"Sure: agent: failed .ZeroDivisionError"),
        (type("Shy", (Bumper,), {"act": lambda *_: (3, {})}), r"Shy: the agent gave int, expected Decisions"),
        (type("Late", (Bumper,), {"__init__": lambda self: None}), r"Late: agent: cannot be made .TypeError"),
        (abs, r"abs: agent: cannot be made .TypeError"),
        (lambda world: 3, r"agent: gives 3, expected an object with sees, reset and act"),
        (object(), r"agent: is <object.*, expected a class or function that takes a World"),
    ],
)
def test_what_is_no_agent_off_the_grid_is_one_line(walkable, agent, words):
    with pytest.raises(AgentError, match=words) as caught:
        evaluate_live(agent, walkable, goals=3, step_limit=6)
    assert "\n" not in str(caught.value)
