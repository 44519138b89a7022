import numpy as np
import pytest

from clearway.evaluation import metrics
from clearway.evaluation.episodes import EpisodeTable


def table() -> EpisodeTable:
    """Five episodes to two targets, with round numbers."""
    steps = np.array([10, 40, 10_000, 500, 499])
    free, collision = steps // 2, np.array([0, 4, 2500, 0, 9])
    return EpisodeTable(
        target=np.array([0, 0, 0, 1, 1]),
        start=np.zeros(5, np.int64),
        steps=steps,
        collisions=np.array([0, 2, 1000, 0, 1]),
        reached=np.array([True, True, False, True, True]),
        shortest_path_steps=np.array([10, 10, 10, 50, 499]),
        zone_steps=np.stack([free, steps - free - collision, collision], 1),
        looped=np.array([False, False, True, False, False]),
    )


def value(name: str) -> list[float]:
    return metrics.by_target(table(), 2)[:, metrics.METRIC_NAMES.index(name)].tolist()


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("steps", [3350, 499.5]),
        ("shortest_path_steps", [10, 274.5]),
        ("path_ratio", [335, 999 / 549]),
        ("collisions", [334, 0.5]),
        ("collisions_per_100_steps", [100 * 1002 / 10_050, 100 / 999]),
        ("collision_free", [1 / 3, 1 / 2]),
        ("success", [2 / 3, 1]),
        ("sc", [2 / 3, 1 / 2]),  # 500 steps are not under 500
        ("sc_4x", [2 / 3, 1 / 2]),  # 40 steps are 4 times 10
        ("spl", [(1 + 0.25 + 0) / 3, (0.1 + 1) / 2]),
        ("collision_free_spl", [1 / 3, 0.05]),
        ("share_free", [0.5, 499 / 999]),
        ("share_precollision", [2521 / 10_050, 491 / 999]),
        ("share_collision", [2504 / 10_050, 9 / 999]),
        ("precollision_visits", [2521 / 3, 491 / 2]),
        ("collision_visits", [2504 / 3, 9 / 2]),
        ("looped", [1 / 3, 0]),
    ],
)
def test_worked_numbers(name, expected):
    assert value(name) == pytest.approx(expected)


def test_a_scene_is_the_mean_of_its_targets_and_the_average_of_scenes():
    targets = np.array([[1.0], [3.0], [10.0]])
    scenes = metrics.by_scene(targets, np.array([0, 0, 1]))
    assert scenes.tolist() == [[2.0], [10.0]]
    assert metrics.average(scenes).tolist() == [6.0]  # not the mean over targets, 14 / 3


def test_every_metric_has_worked_numbers():
    (worked,) = (mark.args[1] for mark in test_worked_numbers.pytestmark)
    assert {name for name, _ in worked} == set(metrics.METRIC_NAMES)
