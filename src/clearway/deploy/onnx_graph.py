"""A trained agent for one scene as PyTorch modules: what is exported, and what exported files are held against.

Axis letters: B batch, K history (newest last), F features, A actions.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from clearway.model.policy import ScenePolicy
from clearway.perception.encoder import NetworkEncoder


class AgentGraph(nn.Module):
    """Pictures to probabilities, value and the history for the next step.

    Args:
        policy: decides.
        encoder: makes features of pictures.
    """

    pixel_mean: Tensor
    pixel_std: Tensor
    feature_mean: Tensor
    feature_std: Tensor

    def __init__(self, policy: ScenePolicy, encoder: NetworkEncoder) -> None:
        super().__init__()
        self.policy, self.encoder_network, self.features_of = policy, encoder.network, encoder.features_of
        size = encoder.preprocessing
        self.height, self.width = size.height, size.width
        self.register_buffer("pixel_mean", torch.tensor(size.mean))
        self.register_buffer("pixel_std", torch.tensor(size.std))
        standardised = encoder.mean is not None and encoder.std is not None
        count = encoder.feature_count
        self.register_buffer("feature_mean", torch.from_numpy(encoder.mean) if standardised else torch.zeros(count))
        self.register_buffer("feature_std", torch.from_numpy(encoder.std) if standardised else torch.ones(count))

    def forward(self, picture: Tensor, start: Tensor, history: Tensor, target: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Probabilities (B, A), value (B, 1), history (B, K, F) after a picture; as `OnnxAgent` asks for it."""
        features = self.features(picture)
        older = torch.where(start[:, None, None], features[:, None].expand_as(history), history)
        after = torch.cat([older[:, 1:], features[:, None]], 1)
        return *self.policy(after, target), after

    def features(self, picture: Tensor) -> Tensor:
        """Features (B, F) of pictures (B, height, width, 3) uint8."""
        pixels = to_input(picture, self.height, self.width, self.pixel_mean, self.pixel_std)
        return (self.features_of(pixels) - self.feature_mean) / self.feature_std


def to_input(picture: Tensor, height: int, width: int, mean: Tensor, std: Tensor) -> Tensor:
    """A network's input (B, 3, height, width) of pictures (B, h, w, 3) uint8, as `preprocess.to_pixels` makes it."""
    planes = picture.permute(0, 3, 1, 2).float()
    rows, columns = resize_weights(planes.shape[2], height), resize_weights(planes.shape[3], width)
    upright = (planes @ columns.T).mT.flatten(0, 2)  # a plain matrix: onnxruntime then takes no pictures at all too
    resized = (upright @ rows.T).reshape(picture.shape[0], 3, width, height).mT
    return (resized / 255 - mean.view(1, 3, 1, 1)) / std.view(1, 3, 1, 1)


def resize_weights(given: int, wanted: int) -> Tensor:
    """The matrix (wanted, given) that resizes a row of pixels bilinearly with antialiasing, as PyTorch does.

    Written out because onnxruntime computes ONNX's own Resize otherwise: up to 11 grey levels away from PyTorch on
    noise of 640 x 480 pixels, 0.1 on a rendered picture, against 0.0001 here.
    """
    scale = given / wanted
    centre = (torch.arange(wanted) + 0.5) * scale
    place = torch.arange(given) + 0.5
    tent = (1 - (place - centre[:, None]).abs() / torch.sym_max(scale, 1.0)).clamp_min(0)
    return tent / tent.sum(1, keepdim=True)
