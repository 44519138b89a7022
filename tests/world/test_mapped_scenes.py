"""Features of scene files in one mapped file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from clearway.errors import RunError, SceneError
from clearway.scenes.digest import scene_digest
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import read_scene, write_scene
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


def test_what_one_process_writes_to_its_features_stays_there(tmp_path: Path) -> None:
    with mapped_scenes(in_files(tmp_path)) as (mapped, _):
        own = make_world(mapped, TARGETS, feature_store="mapped").features
        own += 1
        assert torch.equal(own, make_world(mapped, TARGETS).features + 1)


def test_a_file_that_has_changed_or_holds_no_numbers_is_refused_and_nothing_is_left(
    tmp_path: Path, cache: Path
) -> None:
    scenes = in_files(tmp_path)
    write_scene(grid_scene(3, feature_count=16), tmp_path / "grid.h5")
    with pytest.raises(SceneError, match=r"grid\.h5: has changed"), mapped_scenes(scenes):
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
    found = scene.cells, scene.components
    bare = replace(scene, observations=np.zeros((scene.state_count, 2, 2, 3), np.uint8)).without_pictures()
    assert bare.observations is None
    bare = scene.without_pictures()
    assert (bare.cells is found[0], bare.components is found[1]) == (True, True)
