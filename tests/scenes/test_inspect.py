import json
from dataclasses import replace

import numpy as np
import pytest

from clearway.scenes.feature_spread import feature_spread
from clearway.scenes.inspect import mean_shortest_path_steps, summary
from helpers.made import corridor_scene, grid_scene, scene_of_cells, with_depth


def test_a_corridor_in_figures() -> None:
    figures = summary(corridor_scene(3))
    assert (figures.states, figures.cells, figures.components, figures.component_sizes) == (12, 3, 1, (12,))
    assert figures.mean_degree == pytest.approx(4 / 3)  # the ends have one neighbour, the middle two
    assert figures.blocked_share == pytest.approx(2 / 3)  # 16 of 24: all across, and one at each end
    assert figures.encoder == "made-up"
    assert figures.feature_count == 16
    assert figures.picture_size == (12, 16)
    assert figures.sensors == ("rgb (12 x 16 x 3 uint8, 0 to 255)",)


def test_sensors_are_named_with_unit_and_range() -> None:
    assert summary(with_depth(corridor_scene(2))).sensors[1] == "depth (12 x 16 float32, 0 to 20 m)"


def test_mean_shortest_path_by_hand() -> None:
    one_cell = scene_of_cells(np.array([[0, 0]]))
    assert mean_shortest_path_steps(one_cell) == pytest.approx((1 + 1 + 2) / 3)


def test_mean_shortest_path_is_that_of_all_pairs() -> None:
    scene = grid_scene(2)
    count = scene.state_count
    assert mean_shortest_path_steps(scene) == pytest.approx(scene.distances.sum() / (count * (count - 1)))


def test_separate_parts_are_counted() -> None:
    figures = summary(scene_of_cells(np.array([[0, 0], [5, 5], [5, 6]])))
    assert figures.component_sizes == (8, 4)


def test_a_scene_without_features_or_pictures_has_none() -> None:
    figures = summary(replace(corridor_scene(2), features=None, encoder=None, observations=None))
    assert figures.encoder is figures.spread is figures.picture_size is None


def test_figures_as_json() -> None:
    for scene in (corridor_scene(2), replace(corridor_scene(2), features=None, encoder=None)):
        content = summary(scene).to_json()
        assert content["states"] == 8
        assert "effective_rank" in content
        assert json.loads(json.dumps(content))["component_sizes"] == [8]


def test_spread_counts_directions() -> None:
    rng = np.random.default_rng(0)
    three = rng.normal(size=(4000, 3)) @ np.linalg.qr(rng.normal(size=(20, 3)))[0].T
    assert feature_spread(three).effective_rank == pytest.approx(3, rel=0.02)
    line = np.linspace(1, 2, 50)[:, None] * np.arange(1, 6)
    assert feature_spread(line).effective_rank == pytest.approx(1, abs=1e-6)
    assert feature_spread(np.ones((5, 4))).effective_rank == 0


@pytest.mark.parametrize("pair", [(7, 1400), (1100, 1400)])
def test_spread_finds_the_closest_pair_across_blocks(pair: tuple[int, int]) -> None:
    features = np.random.default_rng(1).normal(size=(1500, 8)).astype(np.float32)
    features[pair[1]] = 3 * features[pair[0]]
    spread = feature_spread(features)
    assert spread.closest_states == pair
    assert spread.closest_cosine_distance < 1e-6


def test_spread_of_a_right_angle_is_1() -> None:
    assert feature_spread(np.eye(3)).closest_cosine_distance == pytest.approx(1)
