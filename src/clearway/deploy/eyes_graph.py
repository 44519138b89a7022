"""Eyes as one PyTorch module: what is exported of the generalist.

Axes: B pictures, N and P rows of features, F features.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from clearway.deploy.onnx_graph import to_input
from clearway.mapping.eyes_sight import Evidence
from clearway.perception.eyes import MEAN, STD
from clearway.perception.eyes_network import Eyes


class EyesGraph(nn.Module):
    """Pictures to features, features to evidence; see `OnnxEyes`.

    Args:
        eyes: that see and compare.
    """

    def __init__(self, eyes: Eyes) -> None:
        super().__init__()
        self.evidence = Evidence(eyes)
        self.size = (eyes.shape.height_px, eyes.shape.width_px)

    def forward(self, picture: Tensor, seen: Tensor, first: Tensor, second: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Of picture (B, height, width, 3) uint8, seen (N, F), first and second (P, F).

        Gives features (B, F), stands (N, 63), whereabouts (P, ELSEWHERE).
        """
        pixels = to_input(picture, *self.size, torch.tensor(MEAN), torch.tensor(STD))
        tokens = self.evidence.eyes(pixels)
        description = self.evidence.eyes.glance(tokens).description
        features = torch.cat([description, tokens.flatten(1)], dim=1)
        return features, self.evidence.stands(seen), self.evidence.whereabouts(first, second)
