"""Quality on episodes typed in by hand."""

import numpy as np
import pytest

from clearway.agents.by_pose import shortest_paths
from clearway.evaluation.criteria import Criteria, Quality, quality
from clearway.evaluation.episodes import EpisodeTable, run_episodes
from clearway.evaluation.metrics import by_target
from clearway.world.world import make_world
from helpers.made import corridor_scene

GOOD = Quality(2, 2, 10.4, 10.0, 0.04, 1.1, "corridor", 3)


def table(target: list[int], steps: list[int], shortest: list[int], collisions: list[int]) -> EpisodeTable:
    count = len(target)
    return EpisodeTable(
        target=np.array(target),
        start=np.zeros(count, np.int64),
        steps=np.array(steps),
        collisions=np.array(collisions),
        reached=np.array(steps) < 10_000,
        shortest_path_steps=np.array(shortest),
        zone_steps=np.zeros((count, 3), np.int64),
        looped=np.zeros(count, bool),
    )


def test_figures_are_means_of_targets_then_of_scenes() -> None:
    scenes = [corridor_scene(5, name="first"), corridor_scene(5, name="second")]
    world = make_world(scenes, {"first": [0, 8], "second": [16]})
    episodes = table([0, 0, 1, 1, 2, 2], [10, 14, 6, 6, 499, 500], [10, 10, 4, 6, 9, 11], [0, 1, 0, 0, 2, 4])
    found = quality(world, by_target(episodes, 3))
    assert (found.target_count, found.solved_targets) == (3, 2)  # 500 steps are too many
    assert found.steps == pytest.approx(((12 + 6) / 2 + 499.5) / 2)
    assert found.shortest_path_steps == pytest.approx(((10 + 5) / 2 + 10) / 2)
    assert found.collisions == pytest.approx(((0.5 + 0) / 2 + 3) / 2)
    assert found.worst_path_ratio == pytest.approx(49.95)
    assert (found.worst_scene, found.worst_target) == ("second", 16)
    assert found.to_json()["path_ratio"] == pytest.approx(found.steps / found.shortest_path_steps)


def test_an_episode_that_fails_leaves_its_target_unsolved() -> None:
    world = make_world([corridor_scene(5)], {"corridor": [0, 8]})
    episodes = table([0, 0, 1], [3, 10_000, 2], [3, 3, 2], [0, 0, 0])
    assert quality(world, by_target(episodes, 2)).solved_targets == 1


def test_the_shortest_path_meets_every_criterion() -> None:
    world = make_world([corridor_scene(5)], {"corridor": [0, 8]})
    found = quality(world, by_target(run_episodes(world, shortest_paths(world), episodes_per_target=20), 2))
    assert found.path_ratio == found.worst_path_ratio == 1
    assert all(found.met(Criteria()).values())


@pytest.mark.parametrize(
    ("found", "failing"),
    [
        (GOOD, set()),
        (Quality(2, 2, 10.5, 10.0, 0.04, 1.15, "corridor", 3), set()),  # at most is held
        (Quality(2, 1, 10.4, 10.0, 0.04, 1.1, "corridor", 3), {"solved_targets"}),
        (Quality(2, 2, 10.6, 10.0, 0.04, 1.1, "corridor", 3), {"path_ratio"}),
        (Quality(2, 2, 10.4, 10.0, 0.04, 1.16, "corridor", 3), {"worst_path_ratio"}),
        (Quality(2, 2, 10.4, 10.0, 0.05, 1.1, "corridor", 3), {"collisions"}),
    ],
)
def test_each_criterion_can_fail_alone(found: Quality, failing: set[str]) -> None:
    met = found.met(Criteria())
    assert {name for name, holds in met.items() if not holds} == (failing | {"all"} if failing else set())
