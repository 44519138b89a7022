"""Features of scene files in one mapped file."""

import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import torch

from clearway.errors import RunError, SceneError
from clearway.scenes.digest import scene_digest
from clearway.scenes.mapped_features import FLOAT_BYTES, MappedFeatures
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import read_scene, write_scene
from clearway.scenes.validate import MAX_FEATURES
from clearway.world.feature_store import joined_features
from clearway.world.mapped_scenes import mapped_scenes
from clearway.world.world import make_world
from helpers.made import corridor_scene, grid_scene

TARGETS = {"corridor": [0], "grid": [1]}


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def in_files(folder: Path) -> list[Scene]:
    scenes = [corridor_scene(3), grid_scene(2, feature_count=16)]
    for scene in scenes:
        write_scene(scene, folder / f"{scene.name}.h5")
    return [read_scene(folder / f"{scene.name}.h5", features_in_file=True) for scene in scenes]


def test_worlds_of_all_scenes_and_of_some_share_one_file_with_the_same_features(tmp_path: Path, cache: Path) -> None:
    scenes = in_files(tmp_path)
    wanted = make_world(scenes, TARGETS).features
    with mapped_scenes(scenes) as (mapped, digests):
        assert digests == [scene_digest(scene) for scene in scenes]
        assert [scene_digest(scene) for scene in mapped] == digests
        whole = make_world(mapped, TARGETS, feature_store="mapped").features
        second = make_world(mapped[1:], {"grid": [1]}, feature_store="mapped").features
        kept = make_world(mapped[::-1], TARGETS).features  # not in the file's order: copied
        maps = Path("/proc/self/maps")
        assert not maps.exists() or str(cache / "mapped") in maps.read_text()
    assert list((cache / "mapped").iterdir()) == []
    first = scenes[0].state_count
    assert torch.equal(whole, wanted)
    assert torch.equal(second, wanted[first:])
    assert torch.equal(kept, torch.cat([wanted[first:], wanted[:first]]))


def test_features_that_all_share_cannot_be_written_to(tmp_path: Path) -> None:
    with mapped_scenes(in_files(tmp_path)) as (mapped, _):
        with pytest.raises(ValueError, match="read-only"):
            np.asarray(mapped[0].features)[0, 0] = 1


@pytest.mark.skipif(sys.platform != "linux", reason="asks Linux for its memory")
def test_features_larger_than_the_memory_are_mapped(tmp_path: Path) -> None:
    sizes = dict(line.split()[:2] for line in Path("/proc/meminfo").read_text().splitlines())
    states = 2 * 1024 * (int(sizes["MemTotal:"]) + int(sizes["SwapTotal:"])) // (FLOAT_BYTES * MAX_FEATURES)
    scene = grid_scene(2)
    with (tmp_path / "features").open("wb") as file:
        file.truncate(states * MAX_FEATURES * FLOAT_BYTES)  # a hole: nothing is on the disk
    large = replace(scene, features=MappedFeatures(tmp_path / "features", 0, (states, MAX_FEATURES)))
    features = joined_features([large], "mapped")
    assert features is not None
    assert (tuple(features.shape), float(features[-1, -1])) == ((states, MAX_FEATURES), 0.0)


def test_features_that_cannot_be_mapped_are_one_clear_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise OSError(12, "Cannot allocate memory")

    with mapped_scenes(in_files(tmp_path)) as (mapped, _):
        monkeypatch.setattr(np, "memmap", refused)
        with pytest.raises(RunError, match=r"features of .* states need .*Cannot allocate memory.*CLEARWAY_CACHE"):
            make_world(mapped, TARGETS, feature_store="mapped")


def test_a_file_that_has_changed_is_refused_and_nothing_is_left(tmp_path: Path, cache: Path) -> None:
    scenes = in_files(tmp_path)
    write_scene(grid_scene(3, feature_count=16), tmp_path / "grid.h5")
    with pytest.raises(SceneError, match=r"grid\.h5: has changed"), mapped_scenes(scenes):
        pass
    assert list((cache / "mapped").iterdir()) == []


def test_features_that_are_no_numbers_are_refused_and_nothing_is_left(tmp_path: Path, cache: Path) -> None:
    in_files(tmp_path)
    with h5py.File(tmp_path / "grid.h5", "r+") as file:
        file["resnet_feature"][1, ..., 3] = np.nan
    scenes = [read_scene(tmp_path / f"{name}.h5", features_in_file=True) for name in TARGETS]
    with pytest.raises(SceneError, match=r"grid\.h5.*1 states, first 1, hold NaN or Inf"), mapped_scenes(scenes):
        pass
    assert list((cache / "mapped").iterdir()) == []


def test_features_of_two_encoders_are_refused(tmp_path: Path) -> None:
    first, second = in_files(tmp_path)
    assert second.encoder is not None
    other = replace(second, encoder=replace(second.encoder, identity="other"))
    with pytest.raises(SceneError, match="features made by"), mapped_scenes([first, other]):
        pass


def test_a_full_disk_is_one_clear_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    scenes = in_files(tmp_path)
    monkeypatch.setattr("clearway.world.feature_store.reserve", full)
    monkeypatch.setattr("clearway.world.mapped_scenes.reserve", full)
    with pytest.raises(RunError, match=r"need 0\.0 GiB.*No space.*CLEARWAY_CACHE"), mapped_scenes(scenes):
        pass


def test_what_was_found_of_a_graph_goes_along_without_pictures() -> None:
    scene = grid_scene(2)
    found = scene.cells, scene.components, scene.held_out
    bare = replace(scene, observations=np.zeros((scene.state_count, 2, 2, 3), np.uint8)).without_pictures()
    assert bare.observations is None
    bare = scene.without_pictures()
    assert (bare.cells is found[0], bare.components is found[1], bare.held_out is found[2]) == (True, True, True)


def test_what_was_found_of_a_graph_goes_along_with_mapped_features(tmp_path: Path) -> None:
    scenes = in_files(tmp_path)
    found = [(scene.cells, scene.components) for scene in scenes]
    with mapped_scenes(scenes) as (mapped, _):
        for scene, (cells, components) in zip(mapped, found, strict=True):
            assert (scene.cells is cells, scene.components is components) == (True, True)
