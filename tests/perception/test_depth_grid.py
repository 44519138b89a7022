from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.errors import EncoderError
from clearway.learn.load import load_agent
from clearway.learn.train import train
from clearway.perception import depth_grid, encode_scenes, encoder_from_record
from clearway.scenes.scene import EncoderRecord, Scene
from clearway.scenes.thor_v1 import read_scene, write_scene
from helpers.made import corridor_scene, grid_scene, with_depth
from helpers.small_runs import small_request


def bare(scene: Scene) -> Scene:
    return replace(scene, features=None, encoder=None)


def test_a_feature_is_the_mean_logarithm_of_a_cells_depth() -> None:
    encoder = replace(depth_grid.from_record(depth_grid.find_record()), rows=2, columns=2)
    depth_m = np.array([[[1, 1, 2, 4, 8], [1, 1, 2, 4, 8], [0, 0.05, 20, 20, 20], [0.1, 0.1, 20, 20, 20]]], np.float32)
    expected = [0.0, np.log(4), np.log(0.1), np.log(20)]  # columns 0 and 1, and 2 to 4
    features = encoder.encode(depth_m)
    assert features.shape == (1, encoder.feature_count) and features.dtype == np.float32
    np.testing.assert_allclose(features[0], expected, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [None, 1])
def test_scenes_with_depth_are_encoded_from_memory_and_from_files_alike(tmp_path: Path, workers: int | None) -> None:
    scenes = [bare(with_depth(scene)) for scene in (grid_scene(0), corridor_scene(5))]
    paths = [tmp_path / f"{scene.name}.h5" for scene in scenes]
    for scene, path in zip(scenes, paths, strict=True):
        write_scene(scene, path)
    encoded = encode_scenes(scenes, "depth-grid", batch=7, workers=workers)
    again = encode_scenes([read_scene(path) for path in paths], encoded[0].encoder, batch=8)
    for scene, other in zip(encoded, again, strict=True):
        assert scene.features.shape == (scene.state_count, 108)
        assert (scene.encoder.name, scene.encoder.settings["sensor"]) == ("depth-grid", "depth")
        encoder = encoder_from_record(scene.encoder)
        np.testing.assert_array_equal(scene.features, encoder.encode(scene.seen_by("depth")[:]))
        np.testing.assert_array_equal(scene.features, other.features)


def test_a_scene_without_depth_is_refused() -> None:
    with pytest.raises(EncoderError, match=r"grid: has rgb, but no depth\. Build or import it again"):
        encode_scenes([bare(grid_scene(0))], "depth-grid")


@pytest.mark.parametrize(
    ("pictures", "problem"),
    [
        (np.zeros((2, 30, 40, 3), np.uint8), r"takes depth, .* found uint8 \(2, 30, 40, 3\)"),
        (np.ones((2, 8, 40), np.float32), "at least 12 x 9 pixels, found 40 x 8"),
    ],
)
def test_what_is_no_depth_is_refused(pictures: np.ndarray, problem: str) -> None:
    with pytest.raises(EncoderError, match=problem):
        encoder_from_record(depth_grid.find_record()).encode(pictures)


@pytest.mark.parametrize("change", [{"rows": 10}, {"rows": 0}, {"columns": "12"}, {"near_m": 1.0}])
def test_an_altered_record_is_refused(change: dict) -> None:
    record = depth_grid.find_record()
    with pytest.raises(EncoderError, match="its record was altered"):
        encoder_from_record(EncoderRecord(record.name, record.identity, {**record.settings, **change}))


def test_agents_train_on_it(tmp_path: Path) -> None:
    (scene,) = encode_scenes([bare(with_depth(corridor_scene(5)))], "depth-grid")
    write_scene(scene, tmp_path / "corridor.h5")
    again = read_scene(tmp_path / "corridor.h5")
    assert again.encoder.identity == scene.encoder.identity
    run = train(small_request(scenes=[again], targets={"corridor": (0, 8)}), tmp_path / "run")
    assert load_agent(run.path).feature_map.feature_count == 108
