"""The recurrent actor-critic: what a picture and the target's have to do with each other, remembered over an episode.

It knows no room and no target, so that one network serves all. What is seen and what the target's picture shows are
features that eyes made; frozen, they compare them (`SeenPairs`), and a gated recurrent unit (Cho et al.,
2014) remembers what came of it.

Axis letters: B episodes, F features, D numbers that tell of a pair, H width, A actions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor, nn

from clearway.perception.eyes_network import DIRECTIONS, Eyes, EyesShape
from clearway.scenes.actions import ACTION_COUNT

LEAST_DEVIATION = 1e-2


class SeenPairs(nn.Module):
    """Frozen eyes that compare features of what is seen with those of the target.

    Args:
        eyes: made the features.
    """

    mean: Tensor
    deviation: Tensor

    def __init__(self, eyes: Eyes) -> None:
        super().__init__()
        self.eyes = eyes
        self.register_buffer("mean", torch.zeros(self.count))
        self.register_buffer("deviation", torch.ones(self.count))
        self.requires_grad_(False)

    @property
    def count(self) -> int:
        """D."""
        shape = self.eyes.shape
        return shape.hidden_width + 5 + 1 + DIRECTIONS + shape.grid.count

    def split(self, features: Tensor) -> tuple[Tensor, Tensor]:
        """Descriptions (B, description_width) and tokens (B, T, C) of features (B, F)."""
        shape = self.eyes.shape
        width = shape.description_width
        return features[:, :width], features[:, width:].unflatten(1, (shape.grid.count, shape.token_width))

    def forward(self, seen: Tensor, target: Tensor) -> Tensor:
        """(B, D) numbers, standardised, that tell of features (B, F) of what is seen and of the target."""
        here, tokens = self.split(seen.float())
        there, target_tokens = self.split(target.float())
        glance, target_glance = self.eyes.glance(tokens), self.eyes.glance(target_tokens)
        told = self.eyes.compare(tokens, target_tokens, glance.depth, target_glance.depth)
        alike = (here * there).sum(dim=1, keepdim=True)
        parts = [told.vector, told.place_m, told.turn, told.overlap[:, None], alike, glance.free, glance.depth]
        return (torch.cat(parts, dim=1) - self.mean) / self.deviation

    def likeness(self, seen: Tensor, before: Tensor) -> Tensor:
        """(B,) cosine of the descriptions of features (B, F): 1 where nothing changed."""
        return (self.split(seen.float())[0] * self.split(before.float())[0]).sum(dim=1)

    def tensors(self) -> dict[str, Tensor]:
        """All that `from_tensors` needs."""
        shape = self.eyes.shape
        sizes = [*shape.widths, shape.token_width, shape.description_width, shape.hidden_width]
        return {**self.state_dict(), "sizes": torch.tensor([*sizes, shape.height_px, shape.width_px])}

    @classmethod
    def from_tensors(cls, tensors: Mapping[str, Tensor]) -> SeenPairs:
        """What `tensors` was called of. Raises LookupError, RuntimeError or ValueError where they do not fit."""
        first, second, third, token, description, hidden, height_px, width_px = tensors["sizes"].tolist()
        shape = EyesShape((first, second, third), token, description, hidden, height_px, width_px)
        made = cls(Eyes(shape))
        made.load_state_dict({name: tensor for name, tensor in tensors.items() if name != "sizes"})
        made.eval()
        return made

    @torch.no_grad()
    def fit(self, seen: Tensor, target: Tensor) -> None:
        """Standardise by pairs of features (B, F) from now on."""
        self.mean.zero_()
        self.deviation.fill_(1)
        told = self(seen, target)
        self.mean.copy_(told.mean(dim=0))
        self.deviation.copy_(told.std(dim=0).clamp_min(LEAST_DEVIATION))


@dataclass(frozen=True)
class RecurrentShape:
    """Sizes of the network.

    Attributes:
        pair_count: D.
        width: H.
    """

    pair_count: int
    width: int = 256


class RecurrentOutput(NamedTuple):
    """What the network says.

    Attributes:
        scores: (B, A) logits of actions.
        value: (B,).
        hidden: (B, H), what is remembered.
    """

    scores: Tensor
    value: Tensor
    hidden: Tensor


LAST_COUNT = ACTION_COUNT + 2
"""Numbers that tell of the last step, see `last_step`."""


def last_step(action: Tensor, likeness: Tensor) -> Tensor:
    """(B, LAST_COUNT) of actions (B,) int64, and the likeness of what was seen before and after, (B,).

    One number an action, one that there was a step at all, and the likeness. Zeros stand for no step.
    """
    taken = nn.functional.one_hot(action, ACTION_COUNT).to(likeness.dtype)
    return torch.cat([taken, torch.ones_like(likeness)[:, None], likeness[:, None]], dim=1)


class RecurrentActorCritic(nn.Module):
    """The network."""

    def __init__(self, shape: RecurrentShape, seed: int = 0) -> None:
        super().__init__()
        self.shape = shape
        width = shape.width
        with torch.random.fork_rng(devices=()):
            torch.manual_seed(seed)
            self.entry = nn.Sequential(
                nn.Linear(shape.pair_count + LAST_COUNT, width), nn.ReLU(), nn.Linear(width, width), nn.ReLU()
            )
            self.memory = nn.GRUCell(width, width)
            self.policy = nn.Sequential(nn.Linear(2 * width, width), nn.ReLU(), nn.Linear(width, ACTION_COUNT))
            self.value = nn.Linear(2 * width, 1)

    def forward(self, pairs: Tensor, last: Tensor, hidden: Tensor) -> RecurrentOutput:
        """One step of B episodes: pairs (B, D), last (B, LAST_COUNT) by `last_step`, hidden (B, H), zeros at first."""
        entered = self.entry(torch.cat([pairs, last], dim=1))
        remembered = self.memory(entered, hidden)
        both = torch.cat([entered, remembered], dim=1)
        return RecurrentOutput(self.policy(both), self.value(both)[:, 0], remembered)
