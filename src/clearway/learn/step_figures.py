"""What comes of the steps of the optimisers, and an update's figures of it, of all workers; see docs/metrics.md."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from clearway.learn.figures import Figures
from clearway.learn.losses import LossTerms
from clearway.learn.peers import Peers


@dataclass(frozen=True)
class StepFigures:
    """What came of a minibatch: its loss, the gradient's norm before clipping, and how much it was."""

    loss: LossTerms
    norm: Tensor
    rows: int
    pairs: int
    histories: int


def loss_figures(steps: Sequence[StepFigures], explained: Tensor, peers: Peers, clips: bool) -> Figures:
    """Figures of the loss, read from the device at once.

    Args:
        steps: of this worker; figures are means over them.
        explained: a scalar, the explained variance of the values.
        peers: whose losses are added up.
        clips: `clipped` is one of the figures.
    """
    names = ("loss", "policy_loss", "value_loss", "entropy", "clipped", "gradient_norm")
    told = torch.stack(
        [torch.stack([s.loss.total, s.loss.policy, s.loss.value, s.loss.entropy, s.loss.clipped]) for s in steps]
    )
    peers.add_up(told)
    norm = torch.stack([s.norm for s in steps])[:, None]
    *means, last = torch.cat([torch.cat([told, norm], 1).mean(0), explained[None]]).tolist()
    figures = {**dict(zip(names, means, strict=True)), "explained_variance": last}
    if not clips:
        del figures["clipped"]
    return figures


def row_figures(steps: Sequence[StepFigures], hindsight_rows: int, peers: Peers) -> Figures:
    """Figures of what was learnt from: hindsight's rows, and shares of rows that are distinct."""
    own = [hindsight_rows, *(sum(getattr(step, name) for step in steps) for name in ("rows", "pairs", "histories"))]
    hindsight, rows, pairs, histories = (int(sum(numbers)) for numbers in zip(*peers.told(*own), strict=True))
    return {
        "hindsight_rows": hindsight,
        "distinct_pairs": pairs / rows,
        "distinct_histories": histories / rows,
    }
