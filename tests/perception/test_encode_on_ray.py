"""Encoding on Ray. Slow: starting a cluster takes some ten seconds."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.perception import encode_scenes
from clearway.perception.encode import find_record
from clearway.perception.preprocess import Preprocessing
from clearway.perception.random_resnet import ResNetShape
from clearway.scenes.thor_v1 import read_scene, write_scene
from helpers.made import corridor_scene, grid_scene
from helpers.on_ray import MARKS, ray

pytestmark = MARKS


def test_a_ray_cluster_encodes_as_one_thread_does(
    tmp_path: Path, own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_scene(replace(grid_scene(0, name="a"), features=None, encoder=None), tmp_path / "a.h5")
    scenes = [read_scene(tmp_path / "a.h5"), replace(corridor_scene(3), features=None, encoder=None)]
    shape = ResNetShape(8, (16, 32), (1, 1), "bottleneck")
    record = find_record("random-resnet50", scenes, shape=shape, preprocessing=Preprocessing(16, 16))
    alone = encode_scenes(scenes, record, batch=7, threads=1)
    monkeypatch.setenv("CLEARWAY_CACHE", str(own_cache / "other"))
    shared = encode_scenes(scenes, record, batch=7, ray="local", workers=1)
    for one, other in zip(alone, shared, strict=True):
        assert np.array_equal(one.features, other.features)
    assert not ray.is_initialized()
