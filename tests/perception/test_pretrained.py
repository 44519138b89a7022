import json
import socket
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from transformers import (
    BertConfig,
    BertModel,
    CLIPConfig,
    CLIPModel,
    PreTrainedModel,
    ResNetConfig,
    ResNetForImageClassification,
    ResNetModel,
    ViTConfig,
    ViTForImageClassification,
    ViTModel,
)

from clearway.errors import EncoderError
from clearway.perception.encoder import Encoder
from clearway.perception.model_files import read_preprocessing
from clearway.perception.preprocess import Preprocessing, to_pixels
from clearway.perception.pretrained import find_record, from_record
from helpers.made import grid_scene

PICTURES = grid_scene(0, picture_size=(24, 32)).observations[:5]


def saved(folder: Path, network: PreTrainedModel, **preprocessor: object) -> str:
    """Save a model as the hub's folders hold it; gives the folder's name."""
    network.eval().save_pretrained(folder)
    if preprocessor:
        (folder / "preprocessor_config.json").write_text(json.dumps(preprocessor))
    return str(folder)


def tiny_resnet(kind: type[PreTrainedModel] = ResNetModel) -> PreTrainedModel:
    torch.manual_seed(0)
    return kind(ResNetConfig(embedding_size=8, hidden_sizes=[16, 32], depths=[1, 1]))


def tiny_vit(kind: type[PreTrainedModel] = ViTModel) -> PreTrainedModel:
    torch.manual_seed(0)
    config = ViTConfig(
        hidden_size=16,
        num_hidden_layers=1,
        num_attention_heads=2,
        intermediate_size=16,
        image_size=32,
        patch_size=16,
    )
    return kind(config)


def loaded(model: str) -> Encoder:
    return from_record(find_record(model))


def test_resnet_features_are_the_pooled_output_of_preprocessed_pictures(tmp_path: Path) -> None:
    network = tiny_resnet()
    size, mean, std = {"shortest_edge": 48}, [0.5, 0.4, 0.3], [0.2, 0.3, 0.4]
    encoder = loaded(saved(tmp_path / "m", network, size=size, image_mean=mean, image_std=std, crop_pct=0.8))
    with torch.inference_mode():
        pixels = to_pixels(PICTURES, Preprocessing(48, 48, (0.5, 0.4, 0.3), (0.2, 0.3, 0.4)))
        expected = network(pixels).pooler_output.flatten(1).numpy()
    assert encoder.feature_count == 32
    assert np.allclose(encoder.encode(PICTURES), expected, atol=1e-5)


def test_a_classifier_gives_the_features_of_its_body(tmp_path: Path) -> None:
    network = tiny_resnet(ResNetForImageClassification)
    encoder = loaded(saved(tmp_path / "m", network))
    with torch.inference_mode():
        expected = network.resnet(to_pixels(PICTURES, Preprocessing())).pooler_output.flatten(1).numpy()
    assert np.allclose(encoder.encode(PICTURES), expected, atol=1e-5)


def test_a_transformer_without_a_trained_pooler_gives_the_mean_of_its_tokens(tmp_path: Path) -> None:
    network = tiny_vit(ViTForImageClassification)
    encoder = loaded(saved(tmp_path / "m", network))
    with torch.inference_mode():
        last = network.vit(to_pixels(PICTURES, Preprocessing(32, 32))).last_hidden_state
    assert np.allclose(encoder.encode(PICTURES), last.mean(dim=1).numpy(), atol=1e-5)


def test_a_transformer_with_a_pooler_gives_its_output(tmp_path: Path) -> None:
    network = tiny_vit()
    encoder = loaded(saved(tmp_path / "m", network))
    with torch.inference_mode():
        expected = network(to_pixels(PICTURES, Preprocessing(32, 32))).pooler_output
    assert np.allclose(encoder.encode(PICTURES), expected.numpy(), atol=1e-5)


def test_a_model_of_pictures_and_text_gives_its_picture_side(tmp_path: Path) -> None:
    small = {"hidden_size": 16, "num_hidden_layers": 1, "num_attention_heads": 2, "intermediate_size": 16}
    vision = {**small, "image_size": 32, "patch_size": 16}
    text = {**small, "vocab_size": 50, "bos_token_id": 1, "eos_token_id": 2}
    network = CLIPModel(CLIPConfig(text_config=text, vision_config=vision))
    encoder = loaded(saved(tmp_path / "m", network))
    with torch.inference_mode():
        expected = network.vision_model(to_pixels(PICTURES, Preprocessing(32, 32))).pooler_output
    assert np.allclose(encoder.encode(PICTURES), expected.numpy(), atol=1e-5)


def test_identity_follows_content_not_place(tmp_path: Path) -> None:
    first = find_record(saved(tmp_path / "a", tiny_resnet()))
    assert find_record(saved(tmp_path / "b", tiny_resnet())).identity == first.identity
    other = find_record(saved(tmp_path / "c", tiny_resnet(), size=32))
    assert other.identity != first.identity
    network = tiny_resnet()
    with torch.no_grad():
        network.embedder.embedder.convolution.weight[0, 0, 0, 0] += 1e-3
    assert find_record(saved(tmp_path / "d", network)).identity != first.identity


def test_a_model_that_was_replaced_is_refused(tmp_path: Path) -> None:
    record = find_record(saved(tmp_path / "a", tiny_resnet()))
    with pytest.raises(EncoderError, match="the features were made by 123"):
        from_record(replace(record, identity="123"))


@pytest.mark.parametrize(
    ("preprocessor", "expected"),
    [
        ({"size": 96}, (96, 96)),
        ({"size": {"height": 60, "width": 80}}, (60, 80)),
        ({"size": {"shortest_edge": 256}, "crop_size": {"height": 224, "width": 224}}, (224, 224)),
        ({"image_mean": [0, 0, 0]}, (224, 224)),
    ],
)
def test_sizes_are_read_in_all_spellings(tmp_path: Path, preprocessor: dict, expected: tuple) -> None:
    folder = Path(saved(tmp_path / "m", tiny_resnet(), **preprocessor))
    found = read_preprocessing(folder, "m")
    assert (found.height, found.width) == expected


def test_no_normalisation_is_respected(tmp_path: Path) -> None:
    folder = Path(saved(tmp_path / "m", tiny_resnet(), do_normalize=False, image_mean=[9, 9, 9]))
    assert read_preprocessing(folder, "m").mean == (0, 0, 0)


def pickle_only(folder: Path) -> None:
    (folder / "model.safetensors").rename(folder / "pytorch_model.bin")


def hide_a_pickle_behind_safetensors(folder: Path) -> None:
    (folder / "model.safetensors").rename(folder / "other.safetensors")
    torch.save(tiny_resnet().state_dict(), folder / "pytorch_model.bin")


def cut_weights(folder: Path) -> None:
    path = folder / "model.safetensors"
    path.write_bytes(path.read_bytes()[:-1000])


def bring_code(folder: Path) -> None:
    config = json.loads((folder / "config.json").read_text())
    config |= {"model_type": "own", "auto_map": {"AutoConfig": "code.Config", "AutoModel": "code.Model"}}
    (folder / "config.json").write_text(json.dumps(config))
    (folder / "code.py").write_text(f"open({str(folder / 'ran')!r}, 'w').close()")


def widen(folder: Path) -> None:
    config = json.loads((folder / "config.json").read_text())
    (folder / "config.json").write_text(json.dumps({**config, "hidden_sizes": [16, 64]}))


def deepen(folder: Path) -> None:
    config = json.loads((folder / "config.json").read_text())
    (folder / "config.json").write_text(json.dumps({**config, "depths": [1, 2]}))


@pytest.mark.parametrize(
    ("spoil", "problem"),
    [
        (pickle_only, "no \\*.safetensors"),
        (hide_a_pickle_behind_safetensors, "cannot be loaded"),
        (cut_weights, "cannot be loaded"),
        (bring_code, "cannot be loaded"),
        (widen, "encoder '"),
        (deepen, "lack weights"),
        (lambda folder: (folder / "config.json").write_text("{"), "cannot be read"),
        (lambda folder: (folder / "config.json").write_text("[]"), "is not a JSON object"),
        (lambda folder: (folder / "config.json").unlink(), "no config.json"),
        (lambda folder: (folder / "preprocessor_config.json").write_text('{"image_std": [0, 0, 0]}'), "positive"),
    ],
)
def test_faulty_folders_are_one_clear_error(tmp_path: Path, spoil: Callable[[Path], None], problem: str) -> None:
    model = saved(tmp_path / "m", tiny_resnet())
    spoil(tmp_path / "m")
    with pytest.raises(EncoderError, match=problem) as caught:
        loaded(model)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "m" / "ran").exists()


def test_a_language_model_is_refused(tmp_path: Path) -> None:
    config = BertConfig(vocab_size=20, hidden_size=8, num_hidden_layers=1, num_attention_heads=1, intermediate_size=8)
    with pytest.raises(EncoderError, match="does not take pictures"):
        loaded(saved(tmp_path / "m", BertModel(config)))


def test_offline_asks_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    monkeypatch.setattr(socket, "getaddrinfo", lambda host, *_, **__: asked.append(host) or [])
    with pytest.raises(EncoderError, match="HF_HUB_OFFLINE"):
        find_record("microsoft/resnet-50")
    with pytest.raises(
        EncoderError, match=r"encoder 'clearwya': .* Did you mean clearway\? .*use clearway, which comes"
    ):
        find_record("clearwya")
    assert not asked


def test_names_that_cannot_be_a_model(tmp_path: Path) -> None:
    with pytest.raises(EncoderError, match="neither a folder nor a model"):
        find_record("no/such/folder")


def test_a_hub_that_cannot_be_reached_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, waits = [], []
    connect = socket.socket.connect

    def counted(self: socket.socket, address: tuple) -> None:
        asked.append(address)
        connect(self, address)

    monkeypatch.setattr(socket.socket, "connect", counted)
    monkeypatch.setattr(time, "sleep", waits.append)
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_OFFLINE", False)
    monkeypatch.setattr(
        "huggingface_hub.constants.HUGGINGFACE_CO_URL_TEMPLATE", "http://127.0.0.1:9/{repo_id}/{filename}"
    )
    with pytest.raises(EncoderError, match="cannot be reached"):
        find_record("microsoft/resnet-50")
    assert ("127.0.0.1", 9) in asked and len(asked) < 10 and sum(waits) < 5


def test_a_folder_in_the_home_of_nobody_is_one_clear_error() -> None:
    with pytest.raises(EncoderError, match="encoder '~nobody-of-this-name/model': there is no such home folder"):
        find_record("~nobody-of-this-name/model")
