"""From a picture to a network's input.

The whole picture is squashed to the network's size, without a crop: an agent must see the edges, where the
things stand that it is about to bump into. The stretch from 4:3 to square is within the aspect ratios
(3:4 to 4:3) that ResNet-50 met in training, costs a quarter less than keeping the ratio, and suits
transformers, whose input size is fixed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np

from clearway.errors import EncoderError

if TYPE_CHECKING:
    import torch

MAX_SIDE = 2_048  # pixels


@dataclass(frozen=True)
class Preprocessing:
    """Size and normalisation of a network's input.

    Attributes:
        height, width: pixels.
        mean, std: of red, green and blue, for values from 0 to 1; the defaults are those of ImageNet.
    """

    height: int = 224
    width: int = 224
    mean: tuple[float, float, float] = (0.485, 0.456, 0.406)
    std: tuple[float, float, float] = (0.229, 0.224, 0.225)

    def to_json(self) -> dict[str, object]:
        """As JSON values, for `preprocessing_from_json`."""
        return {key: list(v) if isinstance(v, tuple) else v for key, v in asdict(self).items()}


def preprocessing_from_json(settings: Mapping[str, object], source: str) -> Preprocessing:
    """The preprocessing that a record or file holds. Raises EncoderError, naming `source`, for nonsense."""
    mean, std = (_three_numbers(settings.get(key), key, source) for key in ("mean", "std"))
    if min(std) <= 0:
        raise EncoderError(f"{source}: the preprocessing's std {list(std)} is not positive. Mend the file")
    height, width = (_side(settings.get(key), key, source) for key in ("height", "width"))
    return Preprocessing(height, width, mean, std)


def _three_numbers(value: object, key: str, source: str) -> tuple[float, float, float]:
    if isinstance(value, list | tuple) and len(value) == 3 and all(isinstance(v, int | float) for v in value):
        red, green, blue = (float(v) for v in value)
        if np.isfinite([red, green, blue]).all():
            return red, green, blue
    raise EncoderError(f"{source}: the preprocessing's {key} is {value!r}, expected three numbers. Mend the file")


def _side(value: object, key: str, source: str) -> int:
    if isinstance(value, int) and 1 <= value <= MAX_SIDE:
        return value
    raise EncoderError(f"{source}: the preprocessing's {key} is {value!r}, expected 1 to {MAX_SIDE}. Mend the file")


def to_pixels(pictures: np.ndarray, preprocessing: Preprocessing) -> torch.Tensor:
    """Network input (B, 3, height, width) float32, channels last in memory, of (B, h, w, 3) uint8 pictures.

    Resized bilinearly with antialiasing. Raises EncoderError for pictures of another shape or type.
    """
    import torch
    from torch.nn.functional import interpolate

    if pictures.ndim != 4 or pictures.shape[3] != 3 or pictures.dtype != np.uint8 or 0 in pictures.shape[1:3]:
        problem = f"pictures are {pictures.dtype} {pictures.shape}, expected uint8 (count, height, width, 3)"
        raise EncoderError(f"{problem}. Give RGB pictures")
    pixels = torch.from_numpy(np.array(pictures)).permute(0, 3, 1, 2).float()
    size = (preprocessing.height, preprocessing.width)
    pixels = interpolate(pixels, size, mode="bilinear", antialias=True, align_corners=False) / 255
    mean, std = (torch.tensor(v).view(1, 3, 1, 1) for v in (preprocessing.mean, preprocessing.std))
    return ((pixels - mean) / std).contiguous(memory_format=torch.channels_last)
