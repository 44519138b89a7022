"""Features that stay in the scene's file until they are looked at."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.scenes.digest import scene_digest
from clearway.scenes.features import FileFeatures
from clearway.scenes.thor_v1 import read_scene, write_scene
from helpers.made import corridor_scene, grid_scene


def in_file(path: Path) -> FileFeatures:
    features = read_scene(path, features_in_file=True).features
    assert isinstance(features, FileFeatures)
    return features


def set_features(path: Path, values: np.ndarray) -> None:
    with h5py.File(path, "r+") as file:
        del file["resnet_feature"]
        file["resnet_feature"] = values


def test_they_are_the_features_that_are_read_at_once(tmp_path: Path) -> None:
    scene = grid_scene(1)
    write_scene(scene, tmp_path / "a.h5")
    lazy = read_scene(tmp_path / "a.h5", features_in_file=True)
    assert lazy.features.shape == scene.features.shape
    assert np.asarray(lazy.features).dtype == lazy.features.dtype == np.float32
    assert np.array_equal(np.asarray(lazy.features), scene.features)
    assert np.asarray(lazy.features, np.float64).dtype == np.float64
    assert scene_digest(lazy) == scene_digest(read_scene(tmp_path / "a.h5"))
    write_scene(lazy, tmp_path / "b.h5")
    assert np.array_equal(read_scene(tmp_path / "b.h5").features, scene.features)


def test_a_published_dump_s_first_of_ten_is_taken(tmp_path: Path) -> None:
    scene = corridor_scene(3)
    write_scene(scene, tmp_path / "a.h5")
    set_features(tmp_path / "a.h5", np.stack([scene.features + n for n in range(10)], 1).astype(np.float64))
    assert np.array_equal(np.asarray(in_file(tmp_path / "a.h5")), scene.features)


def test_they_are_checked_when_they_are_looked_at(tmp_path: Path) -> None:
    write_scene(corridor_scene(3), tmp_path / "a.h5")
    set_features(tmp_path / "a.h5", np.full((12, 1, 16), np.nan))
    features = in_file(tmp_path / "a.h5")
    with pytest.raises(SceneError, match="the features of 12 states, first 0, hold NaN or Inf"):
        np.asarray(features)


def test_their_size_is_checked_at_once(tmp_path: Path) -> None:
    write_scene(corridor_scene(3), tmp_path / "a.h5")
    set_features(tmp_path / "a.h5", np.zeros((11, 1, 16), np.float32))
    with pytest.raises(SceneError, match=r"has shape \(11, 1, 16\)"):
        in_file(tmp_path / "a.h5")


def test_a_damaged_byte_is_noticed_when_they_are_looked_at(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    write_scene(corridor_scene(3), path)
    with h5py.File(path, "r") as file:
        place = file["resnet_feature"].id.get_chunk_info(0).byte_offset
    content = bytearray(path.read_bytes())
    content[place + 20] ^= 1
    path.write_bytes(content)
    features = in_file(path)
    with pytest.raises(SceneError, match="'resnet_feature': is damaged"):
        np.asarray(features)


def test_a_file_that_was_replaced_is_refused(tmp_path: Path) -> None:
    write_scene(corridor_scene(3), tmp_path / "a.h5")
    features = in_file(tmp_path / "a.h5")
    write_scene(replace(corridor_scene(3), features=corridor_scene(3).features + 1), tmp_path / "a.h5")
    with pytest.raises(SceneError, match="has changed since the scene was read"):
        np.asarray(features)


def test_a_scene_without_features_has_none_either_way(tmp_path: Path) -> None:
    write_scene(replace(corridor_scene(3), features=None, encoder=None), tmp_path / "a.h5")
    assert read_scene(tmp_path / "a.h5", features_in_file=True).features is None
