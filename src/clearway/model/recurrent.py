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

from clearway.perception.around import PLACES_M
from clearway.perception.eyes_network import DIRECTIONS, Eyes, EyesShape
from clearway.scenes.actions import ACTION_COUNT

LEAST_DEVIATION = 1e-2


class Sighted(NamedTuple):
    """What eyes tell of pictures by themselves.

    Attributes:
        description: (B, description_width).
        tokens: (B, T, C).
        told: (B, 4 + 63 + T), free ways, places to stand, depth.
    """

    description: Tensor
    tokens: Tensor
    told: Tensor

    def rows(self, index: Tensor) -> Sighted:
        """Those of some pictures, by index."""
        return Sighted(*(values[index] for values in self))


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
        return shape.hidden_width + 5 + 1 + DIRECTIONS + len(PLACES_M) + shape.grid.count

    def sight(self, features: Tensor) -> Sighted:
        """What features (B, F) tell of pictures by themselves."""
        description, flat = features.float().tensor_split([self.eyes.shape.description_width], dim=1)
        tokens = flat.unflatten(1, (self.eyes.shape.grid.count, self.eyes.shape.token_width))
        glance = self.eyes.glance(tokens)
        return Sighted(description, tokens, torch.cat([glance.free, glance.stands, glance.depth], dim=1))

    def compared(self, seen: Sighted, target: Sighted) -> Tensor:
        """(B, D) numbers, standardised, that tell of what is seen and of the target."""
        count = self.eyes.shape.grid.count
        told = self.eyes.compare(seen.tokens, target.tokens, seen.told[:, -count:], target.told[:, -count:])
        alike = likeness(seen.description, target.description)[:, None]
        parts = [told.vector, told.place_m, told.turn, told.overlap[:, None], alike, seen.told]
        return (torch.cat(parts, dim=1) - self.mean) / self.deviation

    def forward(self, seen: Tensor, target: Tensor) -> Tensor:
        """`compared` by features (B, F) of both."""
        return self.compared(self.sight(seen), self.sight(target))

    def description(self, features: Tensor) -> Tensor:
        """(B, description_width) of features (B, F)."""
        return features[:, : self.eyes.shape.description_width].float()

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


def likeness(first: Tensor, second: Tensor) -> Tensor:
    """(B,) cosine of descriptions (B, description_width): 1 where the pictures are the same."""
    return (first * second).sum(dim=1)


@dataclass(frozen=True)
class RecurrentShape:
    """Sizes of the network.

    Attributes:
        pair_count: D.
        width: H.
        remembers: False: it forgets at every step what came before the last one.
    """

    pair_count: int
    width: int = 256
    remembers: bool = True


class RecurrentOutput(NamedTuple):
    """What the network says.

    Attributes:
        scores: (B, A) logits of actions.
        value: (B,).
        arrived: (B,) logit: this is the target.
        hidden: (B, H), what is remembered.
    """

    scores: Tensor
    value: Tensor
    arrived: Tensor
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
            self.arrived = nn.Linear(2 * width, 1)

    def forward(self, pairs: Tensor, last: Tensor, hidden: Tensor) -> RecurrentOutput:
        """One step of B episodes: pairs (B, D), last (B, LAST_COUNT) by `last_step`, hidden (B, H), zeros at first."""
        entered = self.entry(torch.cat([pairs, last], dim=1))
        return self._said(entered, self.memory(entered, self._kept(hidden)))

    def along(self, pairs: Tensor, last: Tensor, hidden: Tensor, begins: Tensor) -> RecurrentOutput:
        """T steps of B episodes, (T, B, ...) each; an episode begins where begins (T, B) bool says so.

        hidden: (B, H), before the first step. The same as T calls, faster.
        """
        entered = self.entry(torch.cat([pairs, last], dim=2))
        remembered = []
        for step in range(len(entered)):
            hidden = self.memory(entered[step], self._kept(torch.where(begins[step, :, None], 0.0, hidden)))
            remembered.append(hidden)
        return self._said(entered, torch.stack(remembered))

    def _kept(self, hidden: Tensor) -> Tensor:
        return hidden if self.shape.remembers else torch.zeros_like(hidden)

    def _said(self, entered: Tensor, remembered: Tensor) -> RecurrentOutput:
        both = torch.cat([entered, remembered], dim=-1)
        return RecurrentOutput(self.policy(both), self.value(both)[..., 0], self.arrived(both)[..., 0], remembered)
