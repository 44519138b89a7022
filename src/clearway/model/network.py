"""The siamese actor-critic (paper, figure 2; Zhu et al., ICRA 2017), written plainly.

    observation history (K x F) --siamese--> H --+
                                                 +--fusion--> H --scene--> H --> 4 action scores, 1 value
    target, tiled K times (K x F) --siamese--> H -+

ReLU after every hidden layer; the scene layer and the outputs, the head, belong to a scene. `lookup` computes the same
function much faster where states are few; this is the definition that it is checked against, and the one to deploy.

Axis letters: B batch, K history (newest last), F features, H hidden width, C heads, A actions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn.functional import linear, relu

from clearway.scenes.actions import ACTION_COUNT

OUTPUTS = ACTION_COUNT + 1  # action scores, then the value


@dataclass(frozen=True)
class NetworkShape:
    """Sizes that determine the parameters.

    Attributes:
        head_count: C, as many as scenes; a single head serves however many scenes.
        feature_count, width, history_length: F, H, K.
    """

    head_count: int
    feature_count: int
    width: int = 512
    history_length: int = 4


class SiameseActorCritic(nn.Module):
    """Policy and value for a history of features and a target's features.

    Parameters are drawn from U(+-1/sqrt(fan_in)), weights and biases alike, as PyTorch's Linear does.

    Args:
        shape: the sizes.
        seed: of the initial parameters.
    """

    def __init__(self, shape: NetworkShape, seed: int = 0) -> None:
        super().__init__()
        self.shape = shape
        scenes, features, width, history = (
            shape.head_count,
            shape.feature_count,
            shape.width,
            shape.history_length,
        )
        generator = torch.Generator().manual_seed(seed)

        def drawn(*size: int, fan_in: int) -> nn.Parameter:
            bound = 1 / math.sqrt(fan_in)
            return nn.Parameter(torch.empty(size).uniform_(-bound, bound, generator=generator))

        self.siamese_weight = drawn(history, width, features, fan_in=history * features)  # (K, H, F)
        self.siamese_bias = drawn(width, fan_in=history * features)
        self.fusion_weight = drawn(2, width, width, fan_in=2 * width)  # observation half, target half
        self.fusion_bias = drawn(width, fan_in=2 * width)
        self.scene_weight = drawn(scenes, width, width, fan_in=width)
        self.scene_bias = drawn(scenes, width, fan_in=width)
        self.output_weight = drawn(scenes, OUTPUTS, width, fan_in=width)
        self.output_bias = drawn(scenes, OUTPUTS, fan_in=width)

    def forward(self, history: Tensor, target: Tensor, scene: Tensor) -> tuple[Tensor, Tensor]:
        """Action scores (B, A) before the softmax, and values (B,).

        Args:
            history: (B, K, F) features of the last K poses, newest last, prepared by `FeatureMap`.
            target: (B, F) features of the target pose, prepared likewise; tiled K times here.
            scene: (B,) int64, whose head to use; a single head is used for all.
        """
        fused = self.fused(history, target)
        output = fused.new_empty(len(fused), OUTPUTS)
        heads = scene if self.shape.head_count > 1 else torch.zeros_like(scene)
        for head in heads.unique().tolist():
            rows = heads == head
            output[rows] = self.head(fused[rows], head)
        return output[:, :ACTION_COUNT], output[:, ACTION_COUNT]

    def fused(self, history: Tensor, target: Tensor) -> Tensor:
        """What all scenes share, (B, H); arguments as in `forward`."""
        seen = self._siamese(history)
        wanted = self._siamese(target[:, None].expand_as(history))
        return relu(linear(seen, self.fusion_weight[0]) + linear(wanted, self.fusion_weight[1]) + self.fusion_bias)

    def head(self, fused: Tensor, scene: int) -> Tensor:
        """Action scores and value (B, A + 1) by one scene's own layers, or by the single head."""
        own = scene if self.shape.head_count > 1 else 0
        special = relu(linear(fused, self.scene_weight[own], self.scene_bias[own]))
        return linear(special, self.output_weight[own], self.output_bias[own])

    def layer_gradients(self) -> list[Tensor]:
        """Gradients of the published network's tensors, as views; the siamese weight's comes first.

        What is stacked here is separate there: every scene's layer and outputs, and the policy's and the value's part.
        """
        shared = (self.siamese_weight, self.siamese_bias, self.fusion_weight, self.fusion_bias)
        views = [grad_of(parameter) for parameter in shared]
        views += [*grad_of(self.scene_weight), *grad_of(self.scene_bias)]
        for head in (*grad_of(self.output_weight), *grad_of(self.output_bias)):
            views += [head[:ACTION_COUNT], head[ACTION_COUNT:]]
        return views

    def _siamese(self, features: Tensor) -> Tensor:
        """(B, K, F) -> (B, H)."""
        weight = self.siamese_weight.transpose(0, 1).flatten(1)  # (H, K * F)
        return relu(linear(features.flatten(1), weight, self.siamese_bias))


def grad_of(parameter: Tensor) -> Tensor:
    """The parameter's gradient, which must be there."""
    assert parameter.grad is not None, "no gradient yet"
    return parameter.grad
