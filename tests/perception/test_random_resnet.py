from dataclasses import replace

import numpy as np
import pytest
import torch

from clearway.errors import EncoderError
from clearway.perception import random_resnet
from clearway.perception.preprocess import Preprocessing, to_pixels
from clearway.perception.random_resnet import ResNetShape, fit_record, from_record
from clearway.scenes.scene import EncoderRecord
from helpers.made import grid_scene

TINY = ResNetShape(8, (16, 32), (1, 1), "bottleneck")
SMALL_PICTURES = Preprocessing(24, 32)
ROOMS = [grid_scene(seed, picture_size=(24, 32)).observations for seed in (0, 1)]


def tiny_record(seed: int = 0, sample_pictures: int = 32) -> EncoderRecord:
    return fit_record(ROOMS, seed=seed, shape=TINY, preprocessing=SMALL_PICTURES, sample_pictures=sample_pictures)


def test_the_record_makes_the_identical_encoder_again() -> None:
    record = tiny_record()
    first, second = from_record(record), from_record(record)
    assert first.feature_count == 32
    features = first.encode(ROOMS[0])
    assert features.shape == (len(ROOMS[0]), 32)
    assert features.dtype == np.float32
    assert np.array_equal(features, second.encode(ROOMS[0]))


def test_a_seed_repeats_and_another_differs() -> None:
    assert tiny_record().identity == tiny_record().identity
    assert tiny_record().identity != tiny_record(seed=1).identity


def test_the_global_random_stream_is_left_alone() -> None:
    torch.manual_seed(5)
    expected = torch.rand(3)
    torch.manual_seed(5)
    tiny_record()
    assert torch.equal(torch.rand(3), expected)


def test_features_are_standardised_over_the_sample() -> None:
    count = sum(len(room) for room in ROOMS)
    encoder = from_record(tiny_record(sample_pictures=2 * count))  # so that all pictures are in it
    features = np.concatenate([encoder.encode(room) for room in ROOMS])
    varied = features.std(axis=0) > 0
    assert varied.sum() > 20
    assert np.allclose(features.mean(axis=0), 0, atol=1e-3)
    assert np.allclose(features[:, varied].std(axis=0), 1, atol=1e-3)


def test_the_frozen_batch_norms_hold_the_sample_statistics() -> None:
    """The first layer's statistics, computed by hand from its convolution."""
    count = sum(len(room) for room in ROOMS)
    record = tiny_record(sample_pictures=2 * count)
    weights = np.random.default_rng(0).standard_normal((8, 3, 7, 7), np.float32) * np.sqrt(2 / (8 * 49))
    pixels = torch.cat([to_pixels(room, SMALL_PICTURES) for room in ROOMS])
    maps = torch.nn.functional.conv2d(pixels, torch.from_numpy(weights.astype(np.float32)), stride=2, padding=3)
    assert np.allclose(record.arrays["batch_norm_mean"][:8], maps.mean(dim=(0, 2, 3)), atol=1e-4)
    assert np.allclose(record.arrays["batch_norm_var"][:8], maps.var(dim=(0, 2, 3)), rtol=1e-3)


def test_every_scene_is_in_the_sample() -> None:
    dark, bright = np.zeros((50, 8, 8, 3), np.uint8), np.full((3, 8, 8, 3), 255, np.uint8)
    record = fit_record([dark, bright], shape=TINY, preprocessing=Preprocessing(8, 8), sample_pictures=6)
    assert record.settings["sample_pictures"] == 6
    features = from_record(record).encode(np.concatenate([dark[:1], bright[:1]]))
    assert np.allclose(features[0], -features[1], atol=1e-3)  # the mean lies halfway


def test_more_scenes_than_pictures_to_sample_give_one_each() -> None:
    assert tiny_record(sample_pictures=1).settings["sample_pictures"] == len(ROOMS) == 2


def test_an_altered_record_is_refused() -> None:
    record = tiny_record()
    moved = {**record.arrays, "feature_mean": record.arrays["feature_mean"] + 1}
    for altered in (
        replace(record, arrays=moved),
        replace(record, arrays={}),
        replace(record, settings={**record.settings, "seed": 9}),
        replace(record, settings={"kind": "random-resnet"}),
    ):
        with pytest.raises(EncoderError, match="Encode the scene again"):
            from_record(altered)


def test_notes_in_the_settings_do_not_matter() -> None:
    record = tiny_record()
    assert from_record(replace(record, settings={**record.settings, "noted": "x"})).feature_count == 32


def forged(record: EncoderRecord, architecture: dict[str, object], arrays: dict[str, np.ndarray]) -> EncoderRecord:
    """A record with other parts, under the identity that is theirs."""
    settings = {**record.settings, "architecture": {**record.settings["architecture"], **architecture}}
    return replace(record, settings=settings, arrays=arrays, identity=random_resnet._identity(settings, arrays))


@pytest.mark.parametrize("name", ["batch_norm_mean", "batch_norm_var", "feature_mean", "feature_std"])
@pytest.mark.parametrize("kind", ["missing", "scalar", "short", "double", "big-endian"])
def test_statistics_that_do_not_fit_are_refused(name: str, kind: str) -> None:
    record = tiny_record()
    values = record.arrays[name]
    change = {
        "scalar": np.float32(1).reshape(()),
        "short": values[:-1],
        "double": values.astype(np.float64),
        "big-endian": values.astype(">f4"),
    }
    arrays = {key: kept for key, kept in record.arrays.items() if key != name}
    if kind in change:
        arrays[name] = change[kind]
    with pytest.raises(EncoderError, match=rf"the statistics '{name}' do not fit .*Encode the scene again"):
        from_record(forged(record, {}, arrays))


@pytest.mark.parametrize(
    ("architecture", "problem"),
    [
        ({"hidden_sizes": [3, 5]}, "unknown architecture"),
        ({"hidden_sizes": [16, 30]}, "unknown architecture"),
        ({"depths": [1, 200]}, "unknown architecture"),
        ({"depths": [4096] * 4, "hidden_sizes": [16] * 4}, "unknown architecture"),
        ({"depths": [1] * 6, "hidden_sizes": [16] * 6}, "unknown architecture"),
        ({"depths": [], "hidden_sizes": []}, "unknown architecture"),
        ({"depths": [100, 100], "hidden_sizes": [4096, 4096], "layer_type": "basic"}, "more than 100,000,000"),
    ],
)
def test_architectures_that_would_take_minutes_or_fail_are_refused(
    architecture: dict[str, object], problem: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = tiny_record()

    def refuse(*_: object) -> None:
        raise AssertionError("a network was built")

    monkeypatch.setattr(random_resnet, "_random_network", refuse)
    with pytest.raises(EncoderError, match=f"{problem}.*Encode the scene again"):
        from_record(forged(record, architecture, dict(record.arrays)))
