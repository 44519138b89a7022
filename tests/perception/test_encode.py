import os
import signal
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import torch
from transformers import ResNetConfig, ResNetModel

from clearway.errors import EncoderError, SceneError
from clearway.perception import encode, encode_scenes, encoder_from_record, random_resnet
from clearway.perception.preprocess import Preprocessing
from clearway.perception.random_resnet import ResNetShape
from clearway.scenes.scene import EncoderRecord, Scene
from clearway.scenes.thor_v1 import read_scene, write_scene
from clearway.torch_threads import torch_threads
from helpers.made import corridor_scene, grid_scene
from helpers.spread_parts import workers_of

needs_proc = pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="looks for processes in /proc")

TINY = ResNetShape(8, (16, 32), (1, 1), "bottleneck")


@pytest.fixture(autouse=True)
def tiny_architecture(monkeypatch: pytest.MonkeyPatch) -> None:
    """A small network stands for ResNet-50."""
    small = partial(encode.find_record, shape=TINY, preprocessing=Preprocessing(16, 16))
    monkeypatch.setattr(encode, "find_record", small)


def rooms() -> list[Scene]:
    made = [grid_scene(0, name="a"), grid_scene(1, name="b"), corridor_scene(3)]
    return [replace(scene, features=None, encoder=None) for scene in made]


@pytest.fixture
def folder_model(tmp_path: Path) -> str:
    torch.manual_seed(0)
    network = ResNetModel(ResNetConfig(embedding_size=8, hidden_sizes=[16, 32], depths=[1, 1])).eval()
    network.save_pretrained(tmp_path / "model")
    return str(tmp_path / "model")


def test_scenes_are_encoded_together_by_one_encoder() -> None:
    scenes = encode_scenes(rooms(), "random-resnet50", seed=4)
    assert {scene.encoder.identity for scene in scenes} == {scenes[0].encoder.identity}
    assert {scene.encoder.name for scene in scenes} == {"random-resnet50"}
    assert scenes[0].encoder.settings["seed"] == 4
    for scene in scenes:
        assert scene.features.shape == (scene.state_count, 32)
        assert scene.features.dtype == np.float32


def test_another_seed_is_another_encoder_though_one_is_cached() -> None:
    first, second = (encode_scenes(rooms()[:1], "random-resnet50", seed=seed)[0].encoder for seed in (0, 1))
    assert (first.settings["seed"], second.settings["seed"]) == (0, 1)
    assert first.identity != second.identity


def test_the_record_in_a_file_makes_the_same_features(tmp_path: Path) -> None:
    scene = encode_scenes(rooms(), "random-resnet50")[0]
    write_scene(scene, tmp_path / "a.h5")
    again = read_scene(tmp_path / "a.h5")
    encoder = encoder_from_record(again.encoder)
    assert np.array_equal(encoder.encode(again.observations[:32]), scene.features[:32])


def test_a_record_encodes_other_scenes_too() -> None:
    record = encode_scenes(rooms()[:2], "random-resnet50")[0].encoder
    (other,) = encode_scenes(rooms()[2:], record)
    assert other.encoder is record


def test_batches_do_not_matter(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = encode_scenes(rooms(), "random-resnet50", batch=7)
    monkeypatch.setenv("CLEARWAY_CACHE", str(own_cache / "other"))
    second = encode_scenes(rooms(), "random-resnet50", batch=64, threads=1)
    for a, b in zip(first, second, strict=True):
        assert np.allclose(a.features, b.features, atol=1e-3)


def test_features_of_other_threads_or_batches_are_not_taken_from_the_cache(own_cache: Path) -> None:
    """Their last bits differ, and those of workers are promised to be the same however many they are."""
    settings = ({"threads": 2}, {"threads": 1}, {"threads": 1, "batch": 7})
    for count, setting in enumerate(settings, start=1):
        for _ in range(2):
            encode_scenes(rooms()[:1], "random-resnet50", **setting)
        assert len(list((own_cache / "features").glob("*.safetensors"))) == count


def test_the_order_of_scenes_does_not_matter(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = encode_scenes(rooms(), "random-resnet50")
    monkeypatch.setenv("CLEARWAY_CACHE", str(own_cache / "other"))
    second = encode_scenes(rooms()[::-1], "random-resnet50")
    assert first[0].encoder.identity == second[0].encoder.identity
    assert np.array_equal(first[0].features, second[-1].features)


@pytest.mark.slow
def test_what_is_cached_needs_no_network(monkeypatch: pytest.MonkeyPatch, folder_model: str) -> None:
    asked = ("random-resnet50", folder_model)
    first = [encode_scenes(rooms(), encoder) for encoder in asked]
    assert not np.array_equal(first[0][0].features, first[1][0].features)

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("a network was loaded")

    monkeypatch.setattr(random_resnet, "_random_network", refuse)
    monkeypatch.setattr(encode, "encoder_from_record", refuse)
    for encoder, scenes in zip(asked, first, strict=True):
        for a, b in zip(scenes, encode_scenes(rooms(), encoder), strict=True):
            assert np.array_equal(a.features, b.features)


def test_kept_features_are_those_of_their_pictures_encoder_and_threads(
    own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenes = encode_scenes(rooms(), "random-resnet50", threads=1)
    encoders = [
        encoder_from_record(encode_scenes(rooms(), "random-resnet50", seed=s, threads=1)[0].encoder) for s in (0, 1)
    ]
    pictures = [scene.observations for scene in scenes[:2]]
    kept = own_cache / "features"
    before = len(list(kept.glob("*.safetensors")))
    for threads, more in ((1, 0), (2, 4)):  # of one thread they are those of the scenes
        with torch_threads(threads):
            found = [encode.kept_features(seen, encoder) for encoder in encoders for seen in pictures]
            made = [encode.features_of(seen, encoder) for encoder in encoders for seen in pictures]
        assert all(np.array_equal(one, other) for one, other in zip(found, made, strict=True))
        assert not np.array_equal(found[0], found[2])
        assert len(list(kept.glob("*.safetensors"))) == before + more
    np.testing.assert_array_equal(encode.kept_features(pictures[0], encoders[0]).shape, scenes[0].features.shape)
    monkeypatch.setattr(encode, "features_of", lambda *_: pytest.fail("encoded again"))
    with torch_threads(2):
        again = [encode.kept_features(seen, encoder) for encoder in encoders for seen in pictures]
    assert all(np.array_equal(one, other) for one, other in zip(found, again, strict=True))


def test_a_damaged_cache_is_made_again(own_cache: Path) -> None:
    first = encode_scenes(rooms(), "random-resnet50")
    for path in own_cache.rglob("*.safetensors"):
        path.write_bytes(path.read_bytes()[:-40])
    second = encode_scenes(rooms(), "random-resnet50")
    assert first[0].encoder.identity == second[0].encoder.identity
    assert np.array_equal(first[1].features, second[1].features)


def test_a_folder_is_an_encoder(folder_model: str) -> None:
    scenes = encode_scenes(rooms(), folder_model)
    encoder = encoder_from_record(scenes[0].encoder)
    assert np.allclose(encoder.encode(scenes[2].observations[:]), scenes[2].features, atol=1e-5)


def test_by_default_the_eyes_that_come_along_encode() -> None:
    (scene,), (again,) = encode_scenes(rooms()[:1]), encode_scenes(rooms()[:1], "clearway")
    assert (scene.encoder.name, scene.encoder.identity) == ("clearway", again.encoder.identity)
    assert np.array_equal(scene.features, again.features)
    encoder = encoder_from_record(scene.encoder)
    assert encoder.feature_count == scene.features.shape[1] == 3200


def test_the_trained_resnet_is_taken_by_its_name(monkeypatch: pytest.MonkeyPatch, folder_model: str) -> None:
    monkeypatch.setattr("clearway.perception.pretrained.RESNET50_MODEL", folder_model)
    (scene,) = encode_scenes(rooms()[:1], "resnet50")
    assert scene.encoder.name == "resnet50"


def test_what_cannot_be_encoded_is_one_clear_error() -> None:
    blind = replace(corridor_scene(3), observations=None)
    with pytest.raises(EncoderError, match="scene corridor has no pictures"):
        encode_scenes([blind], "random-resnet50")
    with pytest.raises(EncoderError, match="Name a scene"):
        encode_scenes([], "random-resnet50")
    with pytest.raises(EncoderError, match="does not say how"):
        encoder_from_record(corridor_scene(3).encoder)


def test_the_calibration_takes_one_thread_whatever_torch_has(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fit, used = random_resnet.fit_record, []

    def fit_record(*arguments: object, **settings: object) -> EncoderRecord:
        used.append(torch.get_num_threads())
        return fit(*arguments, **settings)

    monkeypatch.setattr(random_resnet, "fit_record", fit_record)
    identities = set()
    for threads in (1, 3):
        monkeypatch.setenv("CLEARWAY_CACHE", str(own_cache / str(threads)))
        identities.add(encode_scenes(rooms(), "random-resnet50", threads=threads)[0].encoder.identity)
    assert used == [1, 1]
    assert len(identities) == 1


@pytest.mark.slow
@needs_proc
def test_an_encoding_process_that_is_killed_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    scenes = rooms()
    record = encode_scenes(scenes[:1])[0].encoder
    open_batches = encode._batches

    def kill_first(*arguments: object) -> Iterator[object]:
        for worker in workers_of(os.getpid()):
            os.kill(worker, signal.SIGKILL)
        yield from open_batches(*arguments)

    monkeypatch.setattr(encode, "_batches", kill_first)
    with pytest.raises(EncoderError, match=r"^an encoding process was killed by SIGKILL\. Run .* fewer --workers"):
        encode_scenes(scenes[1:], record, workers=1)


@pytest.mark.slow
def test_several_processes_encode_as_one_thread_does(
    tmp_path: Path, own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_scene(rooms()[0], tmp_path / "a.h5")
    scenes = [read_scene(tmp_path / "a.h5"), rooms()[2]]  # pictures in a file, and in memory
    alone = encode_scenes(scenes, "random-resnet50", batch=7, threads=1)
    monkeypatch.setenv("CLEARWAY_CACHE", str(own_cache / "other"))
    shared = encode_scenes(scenes, alone[0].encoder, batch=7, workers=2)
    for one, other in zip(alone, shared, strict=True):
        assert np.array_equal(one.features, other.features)


@pytest.mark.slow
def test_what_goes_wrong_in_another_process_is_told_as_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record = encode_scenes(rooms()[:1], "random-resnet50")[0].encoder
    write_scene(rooms()[2], tmp_path / "a.h5")
    scene = read_scene(tmp_path / "a.h5")
    write_scene(rooms()[1], tmp_path / "a.h5")
    monkeypatch.setattr(encode, "content_key", lambda pictures: "not looked at here")
    with pytest.raises(SceneError, match="has changed since the scene was read"):
        encode_scenes([scene], record, workers=1)
