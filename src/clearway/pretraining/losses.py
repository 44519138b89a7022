"""What the eyes are taught, as one number to make small, and its parts.

A batch is groups of pictures of one room each; pictures 2 i and 2 i + 1 are two takes of one pose. Every picture is
paired with some others of its group.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from clearway.learn.peers import ALONE, Peers
from clearway.perception.eyes_network import NEAREST_M, Comparison, Eyes, Glance
from clearway.pretraining.labels import PairLabels, token_depth_m
from clearway.pretraining.together import all_rows
from clearway.views.stream import ViewBatch

FREE, STANDS, DEPTH, POSE, OVERLAP, MATCH, PLACE, WHERE = 1.0, 1.0, 1.0, 3.0, 0.5, 0.5, 0.3, 0.2
"""Weights of the parts."""
BEND = 0.1  # where errors begin to count as they are, not squared
SHALLOWEST_M = 0.05
WITHOUT_OVERLAP = 0.15  # weight of a pair whose cameras see nothing alike, beside that of one that sees all alike
OVERLAPPING = 0.25
TOLD_OF_ALL = "place"  # part of the loss that every worker computes of the whole batch
SHARPNESS = 12.0  # of descriptions: how much likelier a picture is the same place for each unit of cosine


@dataclass(frozen=True)
class Parts:
    """The parts of the loss, each a mean over the batch, to which a worker's own pictures give their part.

    Attributes:
        free: of free ways, log metres.
        stands: of whether the body could stand at places around it, nats.
        depth: of depth at the tokens, log metres.
        pose: of relative poses.
        overlap: of whether two pictures see the same.
        match: of which tokens do, nats.
        place: of telling the other take of a pose among all pictures of the batch, nats; that of the whole batch.
        where: of bins of relative poses, nats.
    """

    free: Tensor
    stands: Tensor
    depth: Tensor
    pose: Tensor
    overlap: Tensor
    match: Tensor
    place: Tensor
    where: Tensor

    @property
    def total(self) -> Tensor:
        """The loss."""
        glance = FREE * self.free + STANDS * self.stands + DEPTH * self.depth + PLACE * self.place
        return glance + POSE * self.pose + OVERLAP * self.overlap + MATCH * self.match + WHERE * self.where

    def of_all(self, peers: Peers) -> Parts:
        """Those of the whole batch, of which this worker has a part."""
        if peers.count == 1:
            return self
        own = {name: part.detach() for name, part in vars(self).items() if name != TOLD_OF_ALL}
        summed = torch.stack(list(own.values()))
        peers.add_up(summed)
        return replace(self, **dict(zip(own, summed.unbind(), strict=True)))

    def figures(self) -> dict[str, float]:
        """For metrics.jsonl."""
        return {f"loss_{name}": part.item() for name, part in vars(self).items()} | {"loss": self.total.item()}


@dataclass(frozen=True, eq=False)
class Lesson:
    """A worker's pictures of a batch with all that an update needs.

    Attributes:
        batch: what is known of its B pictures, with depth.
        pixels: (B, 3, height, width), its pictures, relit.
        first, second: (P,) numbers of the pictures that are compared.
        labels: what is true of these pairs.
        part: which pictures of the whole batch these are.
        whole: pictures of the whole batch.
    """

    batch: ViewBatch
    pixels: Tensor
    first: np.ndarray
    second: np.ndarray
    labels: PairLabels
    part: slice
    whole: int

    @property
    def share(self) -> float:
        """Of the whole batch; pairs are as many for each picture."""
        return len(self.batch) / self.whole


def losses(eyes: Eyes, lesson: Lesson, bfloat16: bool, peers: Peers = ALONE) -> Parts:
    """The loss of a batch, on the device of the eyes.

    Args:
        eyes: the network.
        lesson: what this worker learns from.
        bfloat16: the trunk multiplies in it.
        peers: who else has a part of the batch.
    """
    device = eyes.slopes.device
    with torch.autocast(device.type, torch.bfloat16, enabled=bfloat16):
        tokens = eyes(lesson.pixels.to(device))
        glance = eyes.glance(tokens)
    first, second = (torch.from_numpy(numbers).to(device) for numbers in (lesson.first, lesson.second))
    tokens = tokens.float()
    comparison = eyes.compare(tokens[first], tokens[second], glance.depth[first], glance.depth[second])
    free, stands, depth = (lesson.share * part for part in _of_glance(glance, lesson.batch, eyes))
    pose, overlap, match, where = (lesson.share * part for part in _of_comparison(comparison, lesson.labels))
    place = _of_descriptions(all_rows(glance.description, lesson.part, lesson.whole, peers))
    return Parts(free, stands, depth, pose, overlap, match, place, where)


def drawn_pairs(count: int, partners: int, group: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the first and second pictures of pairs, (count x partners,) each, within groups."""
    first = np.repeat(np.arange(count), partners)
    return first, np.minimum(first // group * group + rng.integers(group, size=len(first)), count - 1)


def _of_glance(glance: Glance, batch: ViewBatch, eyes: Eyes) -> tuple[Tensor, Tensor, Tensor]:
    """Losses of free ways, of places to stand at, and of depth."""
    device = glance.free.device
    free = torch.from_numpy(np.log(batch.table.free_m + NEAREST_M).astype(np.float32)).to(device)
    deep_m = np.maximum(token_depth_m(batch.seen["depth"], eyes.shape.grid), SHALLOWEST_M)
    deep = torch.from_numpy(np.log(deep_m)).to(device)
    stands = torch.from_numpy(batch.table.stands).to(glance.stands)
    standing = functional.binary_cross_entropy_with_logits(glance.stands, stands)
    return _bent(glance.free, free).mean(), standing, _bent(glance.depth, deep).mean()


def _of_descriptions(description: Tensor) -> Tensor:
    """Loss of telling the other take of a pose by descriptions of all pictures of a batch."""
    alike = description[0::2] @ description[1::2].T * SHARPNESS
    same = torch.arange(len(alike), device=description.device)
    return (functional.cross_entropy(alike, same) + functional.cross_entropy(alike.T, same)) / 2


def _of_comparison(comparison: Comparison, labels: PairLabels) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Losses of poses (metres count less the farther the cameras stand apart), overlap, matches, and bins of poses."""
    device = comparison.turn.device
    place_m, turn, match, overlap, where = (torch.from_numpy(part).to(device) for part in vars(labels).values())
    weight = (overlap + WITHOUT_OVERLAP).unsqueeze(1)
    scale = 1 / (0.5 + place_m.norm(dim=1, keepdim=True))
    placed = (_bent(comparison.place_m * scale, place_m * scale) * weight).mean()
    turned = (_bent(comparison.turn, turn) * weight).mean()
    shared = functional.binary_cross_entropy_with_logits(comparison.overlap, (overlap > OVERLAPPING).float())
    matched = functional.cross_entropy(comparison.matches.flatten(0, 1), match.flatten())
    return placed + turned, shared, matched, functional.cross_entropy(comparison.whereabouts, where)


def _bent(told: Tensor, true: Tensor) -> Tensor:
    """Errors squared where they are small, as they are where they are large."""
    return functional.smooth_l1_loss(told, true, beta=BEND, reduction="none")
