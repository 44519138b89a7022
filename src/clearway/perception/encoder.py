"""`Encoder`, what every encoder offers, and `NetworkEncoder`, a frozen network behind a preprocessing step.

An encoder is described by its `EncoderRecord` alone: records are found or fitted first, and the network is only
loaded where features are not in the cache.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from clearway.errors import EncoderError
from clearway.perception.preprocess import Preprocessing, to_pixels
from clearway.scenes.scene import EncoderRecord, Scene
from clearway.scenes.sensors import RGB

if TYPE_CHECKING:
    import torch

IDENTITY_LETTERS = 12
SENSOR = "sensor"  # the setting that names whose pictures an encoder takes, where they are not the colour camera's


class Encoder(Protocol):
    """Turns pictures into frozen features."""

    @property
    def record(self) -> EncoderRecord:
        """All that is needed to make this encoder again."""

    @property
    def feature_count(self) -> int:
        """F."""

    def encode(self, pictures: np.ndarray) -> np.ndarray:
        """Features (B, F) float32 of its sensor's pictures (B, ...), for example (B, height, width, 3) uint8."""


@dataclass(frozen=True)
class NetworkEncoder:
    """A frozen network that sees preprocessed pictures.

    Attributes:
        record: what the encoder is.
        preprocessing: how a picture becomes the network's input.
        network: what holds the parameters, frozen.
        features_of: pooled features (B, F) of pixels (B, 3, height, width), by the network.
        feature_count: F.
        mean, std: (F,) float32 statistics by which features are standardised; None leaves them as they are.
    """

    record: EncoderRecord
    preprocessing: Preprocessing
    network: torch.nn.Module
    features_of: Callable[[torch.Tensor], torch.Tensor]
    feature_count: int
    mean: np.ndarray | None = None
    std: np.ndarray | None = None

    def encode(self, pictures: np.ndarray) -> np.ndarray:
        """Features (B, F) float32 of pictures (B, height, width, 3) uint8.

        Equal bit for bit for equal batches at an equal number of threads.

        Raises:
            EncoderError: the pictures are of another shape or type, or a feature is NaN or Inf.
        """
        import torch

        with torch.inference_mode():
            features = self.features_of(to_pixels(pictures, self.preprocessing)).numpy()
        if self.mean is not None and self.std is not None:
            features = (features - self.mean) / self.std
        if not np.isfinite(features).all():
            raise EncoderError(f"encoder {self.record.name} made NaN or Inf of a picture. Use another encoder")
        return np.ascontiguousarray(features, dtype=np.float32)


def sensor_of(record: EncoderRecord) -> str:
    """Name of the sensor whose pictures an encoder takes, see `clearway.scenes.sensors`."""
    return str(record.settings.get(SENSOR, RGB))


def colour_encoder_record(scene: Scene, pictures: str, instead: str) -> EncoderRecord:
    """What made a scene's features of colour pictures, to encode others.

    Args:
        scene: with features.
        pictures: what the others are, in the plural.
        instead: what to do where the scene's encoder takes no colour pictures.

    Raises:
        EncoderError: the encoder is unknown, or takes no colour pictures.
    """
    record = scene.encoder
    if record is None:
        problem = f"scene {scene.name} has no features by a known encoder, by which {pictures} could be encoded"
        raise EncoderError(f"{problem}. Encode it: clearway scenes encode FILES --out FOLDER (and train again)")
    if (seen := sensor_of(record)) != RGB:
        problem = f"scene {scene.name}: its encoder {record.name} sees {seen}, and {pictures} are in colour"
        raise EncoderError(f"{problem}. {instead}")
    return record


def identity_of(settings: Mapping[str, object], contents: Iterable[bytes | memoryview]) -> str:
    """Short hash of an encoder: its settings and whatever bytes determine it besides."""
    digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode())
    for content in contents:
        digest.update(content)
    return digest.hexdigest()[:IDENTITY_LETTERS]
