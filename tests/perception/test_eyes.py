from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from clearway.errors import EncoderError
from clearway.perception import encode_scenes, encoder_from_record, eyes
from clearway.perception.encode import find_record
from clearway.perception.eyes_network import Eyes, EyesShape
from helpers.made import corridor_scene
from helpers.small_eyes import small_eyes

SMALL = EyesShape(widths=(8, 8, 8), token_width=4, description_width=6, hidden_width=8)


def random_eyes(seed: int = 0) -> Eyes:
    return small_eyes(seed, SMALL)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    eyes.write_eyes(tmp_path / "eyes", random_eyes(), {"rooms": 3})
    return tmp_path / "eyes"


def test_eyes_are_read_as_they_were_written_in_half_precision(folder: Path):
    kept, read = random_eyes().state_dict(), eyes.read_eyes(folder).state_dict()
    assert kept.keys() == read.keys()
    for name, tensor in read.items():
        expected = (
            kept[name] if name.endswith(("running_mean", "running_var", "tracked")) else kept[name].half().float()
        )
        torch.testing.assert_close(tensor, expected, rtol=0, atol=0)
    assert eyes.read_card(folder).trained == {"rooms": 3}


def test_a_folder_of_eyes_is_an_encoder(folder: Path):
    record = find_record(str(folder), [])
    assert record.name == "eyes" and record.settings["kind"] == "eyes"
    encoder = encoder_from_record(record)
    pictures = np.random.default_rng(0).integers(256, size=(3, 96, 128, 3), dtype=np.uint8)
    features = encoder.encode(pictures)
    assert features.shape == (3, encoder.feature_count) == (3, 6 + 48 * 4) and features.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(features[:, :6], axis=1), 1, atol=1e-5)
    tokens = eyes.read_eyes(folder)(
        torch.from_numpy(pictures.astype(np.float32) / 255 / 0.25 - 1.8).permute(0, 3, 1, 2)
    )
    np.testing.assert_allclose(features[:, 6:], tokens.flatten(1).numpy(), atol=2e-5)


def test_scenes_are_encoded_by_eyes(folder: Path):
    scene = replace(corridor_scene(), features=None, encoder=None)
    encoded = encode_scenes([scene], str(folder))[0]
    assert encoded.features is not None and encoded.features.shape == (scene.state_count, 6 + 48 * 4)
    assert encoded.encoder is not None and encoded.encoder.name == "eyes"


def test_pictures_of_another_size_are_resized(folder: Path):
    encoder = encoder_from_record(find_record(str(folder), []))
    small = np.random.default_rng(1).integers(256, size=(2, 6, 8, 3), dtype=np.uint8)
    large = small.repeat(16, axis=1).repeat(16, axis=2).repeat(3, axis=1).repeat(3, axis=2)
    np.testing.assert_allclose(encoder.encode(large), encoder.encode(large[:, ::3, ::3]), atol=0.2)


def test_what_is_told_of_pictures_has_its_shapes():
    made = random_eyes().eval()
    with torch.inference_mode():
        tokens = made(torch.randn(5, 3, 96, 128))
        glance = made.glance(tokens)
        told = made.compare(tokens[:3], tokens[2:], glance.depth[:3], glance.depth[2:])
    assert tokens.shape == (5, 48, 4)
    assert (glance.description.shape, glance.free.shape, glance.depth.shape) == ((5, 6), (5, 4), (5, 48))
    assert (told.place_m.shape, told.turn.shape, told.overlap.shape) == ((3, 2), (3, 2), (3,))
    assert told.matches.shape == (3, 48, 49)


def altered(folder: Path) -> str:
    path = folder / "eyes.safetensors"
    content = bytearray(path.read_bytes())
    content[-5] ^= 1
    path.write_bytes(bytes(content))
    return "altered, its SHA-256 is not what eyes.json says. Get the eyes again"


def cut(folder: Path) -> str:
    (folder / "eyes.json").write_text((folder / "eyes.json").read_text()[:40])
    return "eyes.json: damaged"


def huge(folder: Path) -> str:
    path = folder / "eyes.json"
    card = json.loads(path.read_text())
    card["shape"]["token_width"] = 10**9
    path.write_text(json.dumps(card))
    return "eyes.json: damaged"


def large(folder: Path) -> str:
    path = folder / "eyes.json"
    card = json.loads(path.read_text())
    card["shape"] |= {"token_width": 4096, "description_width": 4096, "height_px": 512, "width_px": 512}
    path.write_text(json.dumps(card))
    return r"eyes\.json: a network of [0-9,]+ parameters, more than eyes\.safetensors can hold"


def newer(folder: Path) -> str:
    path = folder / "eyes.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "format_version": 3}))
    return "of format 3, this clearway reads 2. Upgrade clearway"


def gone(folder: Path) -> str:
    (folder / "eyes.safetensors").unlink()
    return "eyes.safetensors: cannot be read"


@pytest.mark.parametrize("harm", [altered, cut, huge, large, newer, gone])
def test_damaged_eyes_are_one_line(folder: Path, harm):
    record = find_record(str(folder), [])
    expected = harm(folder)
    with pytest.raises(EncoderError, match=expected) as told:
        encoder_from_record(record)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("harm", [altered, gone])
def test_damaged_eyes_are_told_also_where_their_features_are_in_the_cache(folder: Path, harm):
    scene = corridor_scene(3)
    encode_scenes([scene], str(folder))
    expected = harm(folder)
    with pytest.raises(EncoderError, match=expected):
        encode_scenes([scene], str(folder))


def test_other_eyes_in_the_folder_are_told(folder: Path):
    record = find_record(str(folder), [])
    eyes.write_eyes(folder, random_eyes(1), {})
    with pytest.raises(EncoderError, match="are others than those that made the features"):
        encoder_from_record(record)


def test_without_shipped_eyes_the_name_says_what_to_do(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setattr(eyes, "SHIPPED", tmp_path)
    with pytest.raises(EncoderError, match=r"eyes that come with clearway are missing from .* Install clearway again"):
        find_record("clearway", [])
    eyes.write_eyes(tmp_path, random_eyes(), {})
    assert find_record("clearway", []).name == "clearway"
