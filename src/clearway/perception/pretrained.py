"""Encoders with trained weights: `resnet50` and any other vision model in the Hugging Face format.

Its features are the model's pooled output, or the mean of its tokens where it has none. Weights are read from
safetensors files alone, and no code that a model brings along is run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clearway.errors import EncoderError
from clearway.perception.encoder import NetworkEncoder, identity_of
from clearway.perception.model_files import CONFIG, PREPROCESSOR, WEIGHTS, find_model, read_preprocessing
from clearway.perception.preprocess import preprocessing_from_json, to_pixels
from clearway.regular_files import blocks_of
from clearway.scenes.scene import EncoderRecord

if TYPE_CHECKING:
    import torch

KIND = "pretrained"
RESNET50_MODEL = "microsoft/resnet-50"


def find_record(model: str, name: str | None = None) -> EncoderRecord:
    """The record of a model by its name on the hub or its folder, from its files alone; `name` is its short name.

    Raises:
        EncoderError: the model cannot be had, see `find_model`, or its files are faulty.
    """
    folder = find_model(model)
    settings: dict[str, object] = {
        "kind": KIND,
        "model": model,
        "preprocessing": read_preprocessing(folder, model).to_json(),
    }
    return EncoderRecord(name or model, _folder_identity(folder, settings), settings)


def from_record(record: EncoderRecord) -> NetworkEncoder:
    """Load the model that a record names.

    Raises:
        EncoderError: the model cannot be had or loaded, is no vision model, or is another than the record's.
    """
    model = str(record.settings.get("model"))
    found = find_record(model, record.name)
    if found.identity != record.identity:
        problem = f"encoder '{model}': is {found.identity}, the features were made by {record.identity}"
        raise EncoderError(f"{problem}. Get that version of the model, or encode the scene again")
    kept = found.settings["preprocessing"]
    assert isinstance(kept, dict)
    preprocessing = preprocessing_from_json(kept, f"encoder '{model}'")
    network, features_of = _load(find_model(model), model)
    gray = np.full((1, preprocessing.height, preprocessing.width, 3), 128, np.uint8)
    with _faults_named(model):
        feature_count = features_of(to_pixels(gray, preprocessing)).shape[1]
    return NetworkEncoder(found, preprocessing, network, features_of, feature_count)


def _folder_identity(folder: Path, settings: dict[str, object]) -> str:
    """Hash of configuration, weights and preprocessing; where the files lie does not matter."""
    names = [CONFIG, *sorted(path.name for path in folder.glob(WEIGHTS))]
    names += [PREPROCESSOR] if (folder / PREPROCESSOR).is_file() else []
    fixed = {"preprocessing": settings["preprocessing"], "files": names}
    try:
        return identity_of(fixed, (part for name in names for part in blocks_of(folder / name)))
    except OSError as fault:
        raise EncoderError(f"encoder '{settings['model']}': cannot be read ({fault}). Check the folder") from fault


def _load(folder: Path, model: str) -> tuple[torch.nn.Module, Callable[[torch.Tensor], torch.Tensor]]:
    """The model in `folder`, and it as a function from pixels (B, 3, h, w) to features (B, F)."""
    import torch
    from transformers import AutoModel

    with _quiet_transformers(), _faults_named(model):
        network, info = AutoModel.from_pretrained(
            folder,
            local_files_only=True,
            trust_remote_code=False,
            use_safetensors=True,
            dtype=torch.float32,
            output_loading_info=True,
        )
        prefix = "vision_model."
        if hasattr(network, "vision_model"):  # models of pictures and text, such as CLIP
            network = network.vision_model
        else:
            prefix = ""
    untrained = [key for key in info["missing_keys"] if key.startswith(prefix)]
    has_pooler = not any("pooler" in key for key in untrained)
    untrained = [key for key in untrained if "pooler" not in key]
    if untrained:
        problem = f"encoder '{model}': its files lack weights ({untrained[0]} and {len(untrained) - 1} more)"
        raise EncoderError(f"{problem}. Get the model again")
    if getattr(network, "main_input_name", "pixel_values") != "pixel_values":
        raise EncoderError(f"encoder '{model}': does not take pictures. Choose a vision model")
    network = network.eval().requires_grad_(False).to(memory_format=torch.channels_last)
    return network, lambda pixels: _pooled(network(pixel_values=pixels), has_pooler)


def _pooled(output: Any, has_pooler: bool) -> torch.Tensor:
    """Features (B, F) of a model's output: pooled, else the mean over tokens (B, T, F) or a map (B, F, h, w)."""
    pooled = getattr(output, "pooler_output", None) if has_pooler else None
    if pooled is not None:
        return pooled.flatten(1)
    last = output.last_hidden_state
    return last.mean(dim=1) if last.ndim == 3 else last.flatten(2).mean(dim=2)


@contextmanager
def _faults_named(model: str) -> Iterator[None]:
    """Turn what transformers raises about a faulty model into an EncoderError."""
    from safetensors import SafetensorError

    faults = (OSError, ValueError, LookupError, TypeError, AttributeError, RuntimeError, ImportError)
    try:
        yield
    except (*faults, SafetensorError) as fault:
        reason = " ".join(str(fault).split())[:300]
        raise EncoderError(f"encoder '{model}': cannot be loaded ({reason}). Choose another vision model") from fault


@contextmanager
def _quiet_transformers() -> Iterator[None]:
    """Keep transformers' progress bars and loading reports off the terminal."""
    from transformers.utils import logging

    before, bars = logging.get_verbosity(), logging.is_progress_bar_enabled()
    logging.set_verbosity_error()
    logging.disable_progress_bar()
    try:
        yield
    finally:
        logging.set_verbosity(before)
        if bars:
            logging.enable_progress_bar()
