"""What the eyes are taught, as one number to make small, and its parts.

A batch is groups of pictures of one room each; pictures 2 i and 2 i + 1 are two takes of one pose. Every picture is
paired with some others of its group.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from clearway.perception.eyes_network import NEAREST_M, Comparison, Eyes, Glance
from clearway.pretraining.labels import PairLabels, pair_labels, token_depth_m
from clearway.views.stream import ViewBatch

FREE, DEPTH, POSE, OVERLAP, MATCH, PLACE = 1.0, 1.0, 3.0, 0.5, 0.5, 0.3
"""Weights of the parts."""
BEND = 0.1  # where errors begin to count as they are, not squared
SHALLOWEST_M = 0.05
WITHOUT_OVERLAP = 0.15  # weight of a pair whose cameras see nothing alike, beside that of one that sees all alike
OVERLAPPING = 0.25
SHARPNESS = 12.0  # of descriptions: how much likelier a picture is the same place for each unit of cosine


@dataclass(frozen=True)
class Parts:
    """The parts of the loss, each a mean.

    Attributes:
        free: of free ways, log metres.
        depth: of depth at the tokens, log metres.
        pose: of relative poses.
        overlap: of whether two pictures see the same.
        match: of which tokens do, nats.
        place: of telling the other take of a pose among all pictures of the batch, nats.
    """

    free: Tensor
    depth: Tensor
    pose: Tensor
    overlap: Tensor
    match: Tensor
    place: Tensor

    @property
    def total(self) -> Tensor:
        """The loss."""
        weighted = FREE * self.free + DEPTH * self.depth + POSE * self.pose
        return weighted + OVERLAP * self.overlap + MATCH * self.match + PLACE * self.place

    def figures(self) -> dict[str, float]:
        """For metrics.jsonl."""
        return {f"loss_{name}": part.item() for name, part in vars(self).items()} | {"loss": self.total.item()}


def losses(
    eyes: Eyes, pixels: Tensor, batch: ViewBatch, partners: int, group: int, rng: np.random.Generator, bfloat16: bool
) -> Parts:
    """The loss of a batch.

    Args:
        eyes: the network.
        pixels: (B, 3, height, width), its pictures, relit.
        batch: what is known of them, with depth.
        partners: pictures that each one is compared with.
        group: pictures of one room that come one after the other.
        rng: chooses partners.
        bfloat16: whether the trunk multiplies in it.
    """
    with torch.autocast(pixels.device.type, torch.bfloat16, enabled=bfloat16):
        tokens = eyes(pixels)
        glance = eyes.glance(tokens)
    first, second = drawn_pairs(len(batch), partners, group, rng)
    labels = pair_labels(batch.table, batch.seen["depth"], first, second, eyes.shape.grid)
    tokens = tokens.float()
    comparison = eyes.compare(tokens[first], tokens[second], glance.depth[first], glance.depth[second])
    free, depth, place = _of_glance(glance, batch, eyes)
    return Parts(free, depth, *_of_comparison(comparison, labels), place)


def drawn_pairs(count: int, partners: int, group: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the first and second pictures of pairs, (count x partners,) each, within groups."""
    first = np.repeat(np.arange(count), partners)
    return first, np.minimum(first // group * group + rng.integers(group, size=len(first)), count - 1)


def _of_glance(glance: Glance, batch: ViewBatch, eyes: Eyes) -> tuple[Tensor, Tensor, Tensor]:
    """Losses of free ways, depth, and descriptions."""
    free = torch.from_numpy(np.log(batch.table.free_m + NEAREST_M).astype(np.float32))
    deep = torch.from_numpy(np.log(np.maximum(token_depth_m(batch.seen["depth"], eyes.shape.grid), SHALLOWEST_M)))
    alike = glance.description[0::2] @ glance.description[1::2].T * SHARPNESS
    same = torch.arange(len(alike))
    place = (functional.cross_entropy(alike, same) + functional.cross_entropy(alike.T, same)) / 2
    return _bent(glance.free, free).mean(), _bent(glance.depth, deep).mean(), place


def _of_comparison(comparison: Comparison, labels: PairLabels) -> tuple[Tensor, Tensor, Tensor]:
    """Losses of poses (metres count less the farther the cameras stand apart), overlap, and matches."""
    place_m, turn, match, overlap = (torch.from_numpy(part) for part in vars(labels).values())
    weight = (overlap + WITHOUT_OVERLAP).unsqueeze(1)
    scale = 1 / (0.5 + place_m.norm(dim=1, keepdim=True))
    placed = (_bent(comparison.place_m * scale, place_m * scale) * weight).mean()
    turned = (_bent(comparison.turn, turn) * weight).mean()
    shared = functional.binary_cross_entropy_with_logits(comparison.overlap, (overlap > OVERLAPPING).float())
    return placed + turned, shared, functional.cross_entropy(comparison.matches.flatten(0, 1), match.flatten())


def _bent(told: Tensor, true: Tensor) -> Tensor:
    """Errors squared where they are small, as they are where they are large."""
    return functional.smooth_l1_loss(told, true, beta=BEND, reduction="none")
