"""`clearway scenes encode`: scenes made one by one can then be trained together."""

from dataclasses import replace

import numpy as np
import pytest

from clearway.scenes.thor_v1 import read_scene, write_scene
from helpers.made import corridor_scene, grid_scene


@pytest.fixture
def files(clearway, tmp_path):
    """Two scenes, each calibrated by itself."""
    folder = tmp_path / "apart"
    scenes = (grid_scene(number, width=4, depth=3, picture_size=(24, 32), name=f"grid{number}") for number in (1, 2))
    for scene in scenes:
        path = folder / f"{scene.name}.h5"
        write_scene(scene, path)
        assert clearway("scenes", "encode", path, "--encoder", "random-resnet50", "--out", path).code == 0
    return folder


@pytest.mark.slow
def test_scenes_apart_cannot_be_trained_until_they_are_encoded_together(clearway, files, small, tmp_path):
    train = ("train", "--out", tmp_path / "run", *small)
    line = clearway(*train[:1], files, *train[1:]).refusal("features made by random-resnet50")
    assert line.endswith("clearway scenes encode FILES --encoder random-resnet50 --out FOLDER")
    together = tmp_path / "together"
    answer = clearway("scenes", "encode", files, "--encoder", "random-resnet50", "--out", together)
    assert answer.code == 0, answer
    assert {path.name for path in together.iterdir()} == {path.name for path in files.iterdir()}
    assert clearway(*train[:1], together, *train[1:]).code == 0


def test_scenes_keep_all_but_their_features(clearway, tmp_path):
    scene = grid_scene(1, width=4, depth=3, picture_size=(24, 32))
    path = tmp_path / "grid.h5"
    write_scene(scene, path)
    before = read_scene(path)
    answer = clearway("scenes", "encode", path, "--out", tmp_path / "other.h5")
    assert answer.code == 0, answer
    found = read_scene(tmp_path / "other.h5")
    assert found.encoder is not None and found.encoder.name == "clearway"
    assert np.array_equal(found.graph, before.graph)
    assert np.array_equal(np.asarray(found.observations[:]), np.asarray(before.observations[:]))
    answer = clearway("scenes", "encode", path, "--out", path)  # over itself
    assert "replaces the scene that was there" in answer.err
    assert np.array_equal(read_scene(path).features, found.features)


def test_what_cannot_be_encoded_is_one_line(clearway, trained, tmp_path):
    path = tmp_path / "a" / "grid.h5"
    write_scene(grid_scene(1, width=4, depth=3, picture_size=(24, 32)), path)
    other = tmp_path / "b" / "grid.h5"
    write_scene(grid_scene(1, width=4, depth=3, picture_size=(24, 32)), other)
    clearway("scenes", "encode", path, other, "--out", tmp_path / "x.h5").refusal("one file for 2 scenes")
    clearway("scenes", "encode", path, other, "--out", tmp_path / "x").refusal("two files have this name")
    assert not (tmp_path / "x").exists()
    blind = tmp_path / "blind.h5"
    write_scene(replace(corridor_scene(), observations=None), blind)
    clearway("scenes", "encode", blind, "--out", tmp_path / "x").refusal("has no pictures")
