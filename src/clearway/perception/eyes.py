"""The encoder `clearway`: the project's own eyes, pretrained on views of generated rooms.

Eyes are a folder of two files: `eyes.json` says how large the network is, how it was trained, and the SHA-256 of
`eyes.safetensors`, its parameters. The shipped ones lie in the package; `clearway pretrain` makes others, which are
used by the name of their folder.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from clearway.errors import EncoderError, reason_of
from clearway.files import json_text, read_json, written_whole
from clearway.perception.encoder import IDENTITY_LETTERS, NetworkEncoder
from clearway.perception.preprocess import Preprocessing
from clearway.regular_files import read_bytes, sha256_of
from clearway.scenes.scene import EncoderRecord

if TYPE_CHECKING:
    import torch

    from clearway.perception.eyes_network import Eyes, EyesShape

NAME, KIND = "clearway", "eyes"
CARD_FILE, WEIGHTS_FILE = "eyes.json", "eyes.safetensors"
FORMAT_VERSION = 2
SHIPPED = Path(__file__).parent / "weights"
MEAN, STD = (0.45, 0.45, 0.45), (0.25, 0.25, 0.25)  # of colours from 0 to 1
MAX_WIDTH, MAX_SIDE_PX = 4096, 512  # of a network's layers and pictures; a card that asks for more is refused
MAX_WEIGHTS_BYTES = 256 * 1024**2
STATISTICS = ("running_mean", "running_var", "whereabouts_seen", "stood")
"""Buffers that are kept as they are; all else is kept in half precision."""


@dataclass(frozen=True)
class EyesCard:
    """What eyes are.

    Attributes:
        shape: sizes of the network.
        sha256: of its parameters' file.
        trained: how, and on what, for people.
    """

    shape: EyesShape
    sha256: str
    trained: Mapping[str, Any]


@dataclass(frozen=True)
class EyesEncoder:
    """Eyes as an encoder.

    Attributes:
        record: what it is.
        eyes: the network.
    """

    record: EncoderRecord
    eyes: Eyes

    @cached_property
    def network(self) -> NetworkEncoder:
        """It as a frozen network; features: the description of a picture, then its tokens, from the upper left."""
        shape = self.eyes.shape
        size = Preprocessing(shape.height_px, shape.width_px, MEAN, STD)
        return NetworkEncoder(self.record, size, self.eyes, self._features_of, self.feature_count)

    @property
    def feature_count(self) -> int:
        """F."""
        return self.eyes.shape.feature_count

    def encode(self, pictures: np.ndarray) -> np.ndarray:
        """Features (B, F) float32 of pictures (B, height, width, 3) uint8, of any size; see `NetworkEncoder.encode`."""
        return self.network.encode(pictures)

    def _features_of(self, pixels: torch.Tensor) -> torch.Tensor:
        import torch

        tokens = self.eyes(pixels)
        return torch.cat([self.eyes.glance(tokens).description, tokens.flatten(1)], dim=1)


def find_record(name: str = NAME) -> EncoderRecord:
    """The record of the shipped eyes, or of those in a folder of that name.

    Raises:
        EncoderError: there are none, or they are damaged.
    """
    if name == NAME and not is_eyes(SHIPPED):
        problem = f"encoder {NAME}: the eyes that come with clearway are missing from {SHIPPED}"
        raise EncoderError(f"{problem}. Install clearway again")
    card = read_card(_folder(name))
    _weights(_folder(name), card)  # features in the cache would hide that they are others, or gone
    settings = {"kind": KIND, "eyes": name, "shape": card.shape.to_json(), "sha256": card.sha256}
    return EncoderRecord(NAME if name == NAME else Path(name).name, card.sha256[:IDENTITY_LETTERS], settings)


def from_record(record: EncoderRecord) -> EyesEncoder:
    """The encoder that a record names. Raises EncoderError where there are other eyes now, none, or damaged ones."""
    name = str(record.settings.get("eyes"))
    _check_same(record, name)
    eyes = read_eyes(_folder(name))
    _check_same(record, name)  # others may have taken their place meanwhile
    return EyesEncoder(record, eyes)


def _check_same(record: EncoderRecord, name: str) -> None:
    if find_record(name).identity != record.identity:
        problem = f"encoder {record.name}: the eyes '{name}' are others than those that made the features"
        raise EncoderError(f"{problem}. Get those, or encode the scene again")


def card_of(record: EncoderRecord) -> EyesCard:
    """What the eyes that a record names are. Raises EncoderError as `read_card` does."""
    return read_card(_folder(str(record.settings.get("eyes"))))


def is_eyes(folder: Path) -> bool:
    """Whether a folder holds eyes."""
    return (folder / CARD_FILE).is_file()


def write_eyes(folder: Path, eyes: Eyes, trained: Mapping[str, Any]) -> None:
    """Write eyes into a folder, the card last.

    Raises:
        OSError: they cannot be written.
    """
    from safetensors.torch import save_file

    state = {name: tensor for name, tensor in eyes.state_dict().items() if not name.endswith("num_batches_tracked")}
    half = {
        name: tensor.float().contiguous() if name.endswith(STATISTICS) else tensor.half().contiguous()
        for name, tensor in state.items()
    }
    folder.mkdir(parents=True, exist_ok=True)
    with written_whole(folder / WEIGHTS_FILE) as part:
        save_file(half, part)
    card = {
        "format_version": FORMAT_VERSION,
        "shape": eyes.shape.to_json(),
        "sha256": sha256_of(folder / WEIGHTS_FILE),
        "trained": dict(trained),
    }
    with written_whole(folder / CARD_FILE) as part:
        part.write_text(json_text(card))


def read_card(folder: Path) -> EyesCard:
    """What the eyes in a folder are. Raises EncoderError where there are none, or the card is damaged."""
    path = folder / CARD_FILE
    try:
        content = read_json(path)
        version = content["format_version"]
        if version != FORMAT_VERSION:
            raise EncoderError(f"{path}: of format {version}, this clearway reads {FORMAT_VERSION}. Upgrade clearway")
        return EyesCard(_shape_of(content["shape"]), str(content["sha256"]), dict(content["trained"]))
    except FileNotFoundError as fault:
        raise EncoderError(
            f"{folder}: no eyes here ({CARD_FILE} is missing). Give what clearway pretrain made"
        ) from fault
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as fault:
        raise EncoderError(f"{path}: damaged ({reason_of(fault)}). Get the eyes again") from fault


def read_eyes(folder: Path) -> Eyes:
    """The eyes in a folder, frozen. Raises EncoderError where they are not as they were written."""
    import torch
    from safetensors import SafetensorError
    from safetensors.torch import load

    from clearway.perception.eyes_network import Eyes

    card = read_card(folder)
    content = _weights(folder, card)
    with torch.device("meta"):  # takes no memory
        count = sum(values.numel() for values in Eyes(card.shape).parameters())
    if count > MAX_WEIGHTS_BYTES // 2:  # in half precision
        problem = f"{folder / CARD_FILE}: a network of {count:,} parameters, more than {WEIGHTS_FILE} can hold"
        raise EncoderError(f"{problem}. Get the eyes again")
    try:
        eyes = Eyes(card.shape)
        state = {name: tensor.float() for name, tensor in load(content).items()}
        counts = {name: tensor for name, tensor in eyes.state_dict().items() if name.endswith("num_batches_tracked")}
        eyes.load_state_dict({**counts, **state})
    except (SafetensorError, RuntimeError) as fault:
        problem = f"{folder / WEIGHTS_FILE}: cannot be read ({reason_of(fault)})"
        raise EncoderError(f"{problem}. Get the eyes again") from fault
    return eyes.eval().requires_grad_(False)


def _weights(folder: Path, card: EyesCard) -> bytes:
    """The file of parameters. Raises EncoderError where it cannot be read, or is not the one that the card names."""
    path = folder / WEIGHTS_FILE
    try:
        content = read_bytes(path, MAX_WEIGHTS_BYTES)
    except OSError as fault:
        raise EncoderError(f"{path}: cannot be read ({reason_of(fault)}). Get the eyes again") from fault
    if hashlib.sha256(content).hexdigest() != card.sha256:
        raise EncoderError(f"{path}: altered, its SHA-256 is not what {CARD_FILE} says. Get the eyes again")
    return content


def _folder(name: str) -> Path:
    return SHIPPED if name == NAME else Path(name)


def _shape_of(content: Mapping[str, Any]) -> EyesShape:
    """The shape that a card tells. Raises ValueError, KeyError or TypeError where it is none."""
    from clearway.perception.eyes_network import EyesShape

    shape = EyesShape(**{**content, "widths": tuple(content["widths"])})
    widths = (*shape.widths, shape.token_width, shape.description_width, shape.hidden_width)
    if len(shape.widths) != 3 or not all(isinstance(width, int) and 1 <= width <= MAX_WIDTH for width in widths):
        raise ValueError(f"widths {widths}")
    for side in (shape.height_px, shape.width_px):
        if not isinstance(side, int) or side % 16 or not 16 <= side <= MAX_SIDE_PX:
            raise ValueError(f"pictures of {shape.height_px} x {shape.width_px}")
    return shape
