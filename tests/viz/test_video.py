import itertools
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from clearway.agents.agent import POSE, Decisions, Observation, State
from clearway.agents.by_features import FeatureAgent
from clearway.agents.by_pose import RandomWalk
from clearway.errors import ClearwayError, RunError, SceneError
from clearway.evaluation.single import single_episode
from clearway.learn.load import TrainedNetwork, load_network
from clearway.learn.train import train
from clearway.viz.video import LAST_FRAME_TIMES, frames, walked, write_video
from helpers.agents import told_after
from helpers.small_runs import small_learner, small_request, small_scenes


@pytest.fixture(scope="module")
def agent(tmp_path_factory: pytest.TempPathFactory) -> TrainedNetwork:
    folder = tmp_path_factory.mktemp("run") / "run"
    return load_network(train(small_request(learner=small_learner(frames=160)), folder).path)


def episode(agent: TrainedNetwork, scene: str | None = None, target: int | None = None, step_limit: int = 9):
    return single_episode(agent, small_scenes(), scene, target, selection="sampled", step_limit=step_limit, seed=4)


def test_the_frames_follow_the_episode(agent: TrainedNetwork) -> None:
    world, trajectory = episode(agent, "grid", 3)
    assert world.scene_names[int(world.target_scene[0])] == "grid"
    assert world.scene_state(0) == 3  # not trained on
    shown = walked(world, agent.on_poses(world), 0, trajectory)
    assert shown.probabilities.shape == (len(trajectory.states), 4)
    np.testing.assert_allclose(shown.probabilities.sum(1), 1, rtol=1e-5)
    pictures = list(frames(small_scenes(), shown))
    assert len(pictures) == len(trajectory.states)
    assert all(side % 2 == 0 for side in pictures[0].shape[:2])  # as H.264 wants it
    assert all((a != b).any() for a, b in itertools.pairwise(pictures))


def test_the_agent_is_asked_with_the_poses_that_it_walked_through(agent: TrainedNetwork) -> None:
    world, trajectory = episode(agent)
    goals, asked = [], []

    class Watched:
        sees = (POSE,)

        def reset(self, target: Observation, seed: np.ndarray) -> State:
            goals.append(target[POSE].tolist())
            return agent.on_poses(world).reset(target, seed)

        def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
            asked.append(observation[POSE].tolist())
            return agent.on_poses(world).act(observation, state)

    shown = walked(world, Watched(), 0, trajectory)
    states = trajectory.states.tolist()
    assert goals == [world.target_state.tolist()]
    assert asked == [[state] for state in states]
    history = torch.from_numpy(trajectory.states[[2, 3, 4, 5]])[None]
    told = told_after(agent.on_poses(world), world, history, torch.tensor([0]))
    np.testing.assert_allclose(shown.probabilities[5], told[0], rtol=1e-5)  # by what it remembers of the three before


def test_an_agent_that_sees_features_tells_the_same_and_a_silent_one_nothing(agent: TrainedNetwork) -> None:
    world, trajectory = episode(agent, "grid", 3)
    by_pose = walked(world, agent.on_poses(world), 0, trajectory)
    by_features = walked(world, FeatureAgent(agent.in_scene(1)), 0, trajectory)
    np.testing.assert_allclose(by_features.probabilities, by_pose.probabilities, rtol=1e-4, atol=1e-6)

    class Silent(RandomWalk):
        def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
            decisions, after = super().act(observation, state)
            return Decisions(decisions.action), after

    shown = walked(world, Silent(), 0, trajectory)
    assert shown.probabilities is None
    assert len(list(frames(small_scenes(), shown))) == len(trajectory.states)


@pytest.mark.parametrize("name", ["film.mp4", "film.gif"])
def test_a_film_can_be_read_again(agent: TrainedNetwork, tmp_path: Path, name: str) -> None:
    world, trajectory = episode(agent, step_limit=4)
    pictures = list(frames(small_scenes(), walked(world, agent.on_poses(world), 0, trajectory)))
    write_video(tmp_path / name, iter(pictures), frames_per_s=2)
    expected = len(pictures) + LAST_FRAME_TIMES
    if name.endswith(".gif"):
        with Image.open(tmp_path / name) as film:
            length_ms = 0
            for frame in range(film.n_frames):  # equal frames become one that stays longer
                film.seek(frame)
                length_ms += film.info["duration"]
        assert length_ms == 500 * expected
        return
    import av

    with av.open(str(tmp_path / name)) as film:
        found = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
        assert film.streams.video[0].average_rate == 2
    assert len(found) == expected
    assert found[0].shape == pictures[0].shape
    assert np.abs(found[0].astype(float) - pictures[0]).mean() < 4


@pytest.mark.parametrize(("frames_per_s", "duration_ms"), [(3, 330), (15, 70), (50, 20)])
def test_a_gif_is_as_fast_as_asked_for(frames_per_s: int, duration_ms: int, tmp_path: Path) -> None:
    pictures = [np.full((4, 4, 3), level, np.uint8) for level in (0, 100, 200)]
    write_video(tmp_path / "film.gif", iter(pictures), frames_per_s=frames_per_s)
    with Image.open(tmp_path / "film.gif") as film:
        assert film.info["duration"] == duration_ms


def test_a_film_faster_than_any_screen_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match=r"film\.mp4: 1000 frames/s, expected at most 240"):
        write_video(tmp_path / "film.mp4", iter([np.zeros((4, 4, 3), np.uint8)]), frames_per_s=1000)


def test_a_gif_faster_than_viewers_show_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match=r"film\.gif: 51 frames/s in a GIF.*MP4"):
        write_video(tmp_path / "film.gif", iter([np.zeros((4, 4, 3), np.uint8)]), frames_per_s=51)
    assert not list(tmp_path.iterdir())


def test_another_ending_is_refused_and_leaves_nothing(agent: TrainedNetwork, tmp_path: Path) -> None:
    world, trajectory = episode(agent, step_limit=2)
    pictures = frames(small_scenes(), walked(world, agent.on_poses(world), 0, trajectory))
    with pytest.raises(ClearwayError, match=r"film\.avi.*\.mp4 or \.gif"):
        write_video(tmp_path / "film.avi", pictures)
    assert not list(tmp_path.iterdir())


def test_scenes_and_targets_that_are_not_there_are_refused(agent: TrainedNetwork) -> None:
    with pytest.raises(RunError, match="corridor, grid"):
        episode(agent, "attic")
    with pytest.raises(SceneError, match="99999"):
        episode(agent, "grid", 99999)
