"""The stores of a world's features."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from clearway.choices import FeatureStore
from clearway.errors import RunError, SceneError
from clearway.scenes.thor_v1 import read_scene, write_scene
from clearway.world.feature_store import empty_store, mapped_store
from clearway.world.world import World, make_world
from helpers.made import corridor_scene, grid_scene


def stored(store: FeatureStore) -> World:
    scenes = [corridor_scene(3), grid_scene(2, feature_count=16)]
    return make_world(scenes, {"corridor": [0], "grid": [1]}, feature_store=store)


def test_a_mapped_store_holds_the_same_features_in_a_file_that_has_no_name(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    kept, mapped = stored("memory").features, stored("mapped").features
    assert torch.equal(mapped, kept)
    assert mapped.dtype == torch.float32
    assert list((tmp_path / "cache").iterdir()) == []
    assert str(tmp_path / "cache") in Path("/proc/self/maps").read_text() or not Path("/proc/self/maps").exists()


def test_float16_takes_half_the_memory_and_rounds() -> None:
    kept, half = stored("memory").features, stored("float16").features
    assert half.nbytes == kept.nbytes // 2
    assert torch.equal(half, kept.half())
    assert not torch.equal(half.float(), kept)


@pytest.mark.parametrize("store", ["memory", "float16", "mapped"])
def test_features_in_files_are_stored_alike(tmp_path: Path, monkeypatch, store: FeatureStore) -> None:
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    scene = grid_scene(2, feature_count=16)
    write_scene(scene, tmp_path / "grid.h5")
    lazy = read_scene(tmp_path / "grid.h5", features_in_file=True)
    found = make_world([corridor_scene(3), lazy], {"corridor": [0], "grid": [1]}, feature_store=store)
    assert torch.equal(found.features, stored(store).features)
    assert found.feature_store == store


def test_features_that_float16_cannot_hold_are_refused() -> None:
    scene = corridor_scene(3)
    with pytest.raises(SceneError, match=r"beyond 65,504.*another store"):
        make_world([replace(scene, features=scene.features * 1e6)], {"corridor": [0]}, feature_store="float16")


def test_a_full_disk_is_one_clear_error(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", full, raising=False)
    with pytest.raises(RunError, match=r"cache: 10 features of 100 states need 0\.0 GiB.*No space.*CLEARWAY_CACHE"):
        mapped_store((), 100, 10)
    assert list((tmp_path / "cache").iterdir()) == []


def test_blocks_lie_one_after_the_other_in_a_file_without_a_name(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    rows = np.arange(15, dtype=np.float64).reshape(5, 3)
    kept = mapped_store((rows[:2], rows[2:2], rows[2:]), 5, 3)
    assert torch.equal(kept, torch.from_numpy(rows).float())
    assert list((tmp_path / "cache").iterdir()) == []


def test_memory_that_cannot_be_had_is_one_clear_error() -> None:
    with pytest.raises(RunError, match=r"need 8388608\.0 GiB of memory.*--feature-store mapped"):
        empty_store(2**31, 2**20, "memory")


def test_a_gpu_without_room_is_named_not_the_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> None:
        raise torch.OutOfMemoryError("CUDA out of memory")

    monkeypatch.setattr(torch, "empty", full)
    with pytest.raises(
        RunError, match=r"on cuda, which cannot be had \(CUDA out of memory\)\. Give fewer scenes, or --device cpu"
    ):
        empty_store(2, 3, "mapped", "cuda")
