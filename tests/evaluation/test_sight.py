"""An agent is given what it sees, and nothing more."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from clearway.agents.agent import FEATURES, POSE, Decisions, Observation, State
from clearway.agents.by_features import FeatureAgent
from clearway.errors import AgentError, SceneError
from clearway.evaluation.episodes import EpisodeTable, run_episodes
from clearway.evaluation.sight import Sight
from clearway.scenes.actions import Action
from clearway.scenes.sensors import DEPTH, RGB
from clearway.world.world import World, make_world
from helpers.agents import Spy
from helpers.made import with_depth
from helpers.small_runs import small_scenes, small_targets, trained_network

SCENES = [with_depth(scene) for scene in small_scenes()]
WORLD = make_world(SCENES, small_targets())
COUNTS = ("target", "start", "steps", "collisions", "reached", "zone_steps", "looped")


def expected(name: str, pose: int) -> np.ndarray:
    """What a sensor measures in a pose of the world's numbering, straight from the scenes."""
    scene = SCENES[0] if pose < SCENES[0].state_count else SCENES[1]
    own = pose if scene is SCENES[0] else pose - SCENES[0].state_count
    kept = {POSE: pose, FEATURES: scene.features[own], RGB: scene.observations[own], DEPTH: scene.seen_by(DEPTH)[own]}
    return np.asarray(kept[name])


@pytest.mark.parametrize(
    "sees", [(), (POSE,), (FEATURES,), (RGB,), (DEPTH,), (POSE, RGB), (RGB, DEPTH, FEATURES, POSE)]
)
def test_an_agent_is_given_what_it_sees_and_nothing_more(sees: tuple[str, ...]) -> None:
    spy = Spy(*sees)
    table = run_episodes(WORLD, spy, scenes=SCENES, episodes_per_target=3, step_limit=12, record=True)
    (target,) = spy.targets
    goals = WORLD.target_state.numpy()[table.target]
    assert tuple(target) == sees
    for name in sees:
        assert np.array_equal(target[name], [expected(name, goal) for goal in goals.tolist()])
    for step, observation in enumerate(spy.seen):
        assert tuple(observation) == sees
        poses = [int(walk.states[step]) for walk in table.trajectories if len(walk.actions) > step]
        for name in sees:
            wanted = np.stack([expected(name, pose) for pose in poses])
            assert np.array_equal(observation[name], wanted)
            assert observation[name].dtype == (np.int64 if name == POSE else wanted.dtype)


class Counted:
    """Pictures that note which of them are read."""

    def __init__(self, pictures) -> None:
        self.shape, self._pictures, self.read = pictures.shape, pictures, []

    def __getitem__(self, index):
        self.read += np.atleast_1d(np.arange(self.shape[0])[index]).tolist()
        return self._pictures[index]


@pytest.mark.parametrize(("most", "read"), [(512 * 2**20, [3, 1, 2]), (10, [3, 3, 1, 2, 3])])
def test_a_picture_is_unpacked_once_where_all_fit(monkeypatch, most: int, read: list[int]) -> None:
    monkeypatch.setattr("clearway.evaluation.sight.MOST_KEPT_BYTES", most)
    counted = Counted(SCENES[0].observations)
    sight = Sight(WORLD, Spy(RGB), [replace(SCENES[0], observations=counted), SCENES[1]])
    for states in ([3, 3], [1, 2, 3]):
        seen = sight(torch.tensor(states))[RGB]
        assert np.array_equal(seen, [expected(RGB, state) for state in states])
    assert [row for row in counted.read if row] == read  # row 0 tells the dtype


def test_pictures_of_poses_in_two_scenes_are_gathered_right() -> None:
    first = SCENES[0].state_count
    states = torch.tensor([first + 4, 0, first - 1, first + 1, 3, WORLD.state_count - 1])
    found = Sight(WORLD, Spy(RGB, DEPTH), SCENES)(states)
    assert (found[RGB].dtype, found[DEPTH].dtype) == (np.uint8, np.float32)
    for row, state in enumerate(states.tolist()):
        assert np.array_equal(found[RGB][row], expected(RGB, state))
        assert np.array_equal(found[DEPTH][row], expected(DEPTH, state))
    assert len({picture.tobytes() for picture in found[RGB]}) == len(states), "all look alike: this shows nothing"


def bare(world: World) -> World:
    return replace(world, features=None)


@pytest.mark.parametrize(
    ("sees", "world", "scenes", "error", "said"),
    [
        (
            RGB,
            WORLD,
            [],
            AgentError,
            r"the agent sees rgb, and poses and features alone are known here\. Give the scenes",
        ),
        ("lidar", WORLD, [], AgentError, r"the agent sees lidar, and poses and features alone"),
        ("lidar", WORLD, SCENES, SceneError, r"has rgb, depth, but no lidar\. Choose among rgb, depth, or give"),
        (
            RGB,
            WORLD,
            [replace(one, observations=None) for one in small_scenes()],
            SceneError,
            r"corridor: has no pictures, so no rgb\. Build or import it again with --sensors rgb$",
        ),
        (DEPTH, WORLD, small_scenes(), SceneError, r"corridor: has rgb, but no depth\. .*--sensors rgb depth"),
        (
            RGB,
            WORLD,
            [replace(one, observations=None) for one in SCENES],
            SceneError,
            "corridor: has depth, but no rgb",
        ),
        (FEATURES, bare(WORLD), SCENES, AgentError, r"the agent sees features, and the scenes have none\. Encode them"),
    ],
)
def test_what_is_not_there_is_named_in_one_line(sees, world, scenes, error, said) -> None:
    with pytest.raises(error, match=said) as caught:
        run_episodes(world, Spy(sees), scenes=scenes, episodes_per_target=1)
    assert "\n" not in str(caught.value)


def test_pictures_of_two_sizes_are_refused_by_name() -> None:
    corridor, grid = small_scenes()
    wider = replace(grid, observations=np.zeros((grid.state_count, 12, 18, 3), np.uint8))
    with pytest.raises(AgentError, match=r"^scene grid: .*\(12, 18, 3\), those of corridor \(12, 16, 3\)\. [^\n]*$"):
        run_episodes(WORLD, Spy(RGB), scenes=[corridor, wider], episodes_per_target=1)


def same(one: EpisodeTable, other: EpisodeTable) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in COUNTS)


def test_an_agent_by_features_walks_the_episodes_of_the_network_from_tables() -> None:
    trained = trained_network()
    world = make_world([SCENES[1]], {"grid": small_targets()["grid"]})
    settings = {"episodes_per_target": 20, "step_limit": 60, "seed": 2}
    by_features = run_episodes(world, FeatureAgent(trained.in_scene(1)), **settings)
    both = run_episodes(WORLD, trained.on_poses(WORLD), **settings)
    there = WORLD.target_scene.numpy()[both.target] == 1
    for name in ("steps", "collisions", "reached", "zone_steps"):
        assert np.array_equal(getattr(by_features, name), getattr(both, name)[there]), name
    assert np.array_equal(by_features.start, both.start[there] - SCENES[0].state_count)


class Shade:
    """Walks ahead where the first pixel is bright, and turns right where it is dark."""

    sees = (RGB,)

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        return {"seen": np.zeros(len(seed), np.int64)}

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        bright = observation[RGB][:, 0, 0, 0] > 128
        action = np.where(bright, int(Action.MOVE_FORWARD), int(Action.TURN_RIGHT))
        return Decisions(action), {"seen": state["seen"] + 1}


def test_an_agent_by_pictures_that_tells_nothing_else_is_evaluated() -> None:
    """Whatever runs beside it; and its actions are those of what it saw."""
    settings = {"scenes": SCENES, "episodes_per_target": 6, "step_limit": 40}
    table = run_episodes(WORLD, Shade(), record=True, **settings)
    assert same(table, run_episodes(WORLD, Shade(), **settings))
    assert same(table, run_episodes(WORLD, Shade(), episodes_at_once=7, **settings))
    for walk in table.trajectories:
        bright = [expected(RGB, pose)[0, 0, 0] > 128 for pose in walk.states[:-1].tolist()]
        assert walk.actions.tolist() == [0 if light else 1 for light in bright]
    assert 0 < table.reached.mean() < 1
