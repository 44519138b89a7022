"""Minibatches in which everything that the network sees twice is computed once.

Trained agents come by the same way again and again, and many targets are walked to from the same poses: at the end of
the demo a minibatch holds 0.18 histories a row, and 0.34 pairs of a history and a target. Outputs depend on nothing
else. So rows of one history are dealt into the same minibatch, each pair is computed once, and its rows' gradients are
added up before they go back through the network. Nothing is approximated. Where the network computes round numbers of
rows faster, pairs and histories are repeated up to such a number; nothing is learnt from those.

Axis letters: B rows, P pairs, U histories, K history, A actions.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import torch
from torch import Tensor

from clearway.learn.losses import Batch
from clearway.model.padding import Padding
from clearway.model.sums import sum_ascending


@dataclass(frozen=True)
class Minibatch:
    """Rows to learn from at once, and what the network has to compute for them; all ordered by scene.

    Attributes:
        rows: B rows.
        pair_of: (B,) int64, ascending, the pair of each row; None where every row is a pair by itself.
        target: (P,) int64, of each pair.
        history_of: (P,) int64, ascending, the history of each pair; None where every pair has its own.
        history: (U, K) int64.
        pairs_per_scene: number of pairs of each scene.
        pair_count, history_count: how many pairs and histories differ.
    """

    rows: Batch
    pair_of: Tensor | None
    target: Tensor
    history_of: Tensor | None
    history: Tensor
    pairs_per_scene: tuple[int, ...]
    pair_count: int
    history_count: int

    @classmethod
    def whole(cls, batch: Batch) -> Minibatch:
        """All rows of a batch as they are, none of them put together with another."""
        rows = len(batch)
        return cls(batch, None, batch.target, None, batch.history, batch.rows_per_scene, rows, rows)

    def by_row(self, output: Tensor) -> Tensor:
        """Outputs (P, A + 1) of pairs, for each row: (B, A + 1)."""
        return output if self.pair_of is None else output[self.pair_of]

    def by_pair(self, gradient: Tensor) -> Tensor:
        """Gradients (B, A + 1) of rows, added up by pair: (P, A + 1)."""
        return gradient if self.pair_of is None else sum_ascending(gradient, self.pair_of, len(self.target))


class Deck:
    """A batch's rows, sorted by history and target, to be dealt into minibatches.

    Args:
        batch: at least one row.
        state_count, target_count: of the world.
        row_step: of what a minibatch's numbers of pairs of a scene, and of histories, are multiples.

    Attributes:
        batch: its rows in the new order.
        history, pair: (B,) int64, ascending: the rank of each row's history, and of its pair.
    """

    def __init__(self, batch: Batch, state_count: int, target_count: int, row_step: int = 1) -> None:
        self.row_step = row_step
        slots = batch.history.flip(1).T  # newest first: states are numbered by scene, so sorting keeps scenes together
        history = slots[0]
        for slot in slots[1:]:
            history = _rank(history * state_count + slot)
        pair = _rank(history * target_count + batch.target)
        order = torch.argsort(pair, stable=True)
        self.batch = batch.rows(order, batch.rows_per_scene)
        self.history, self.pair = _rank(history)[order], pair[order]
        rows_per_scene = torch.tensor(batch.rows_per_scene, device=pair.device)
        self.scene = torch.arange(len(rows_per_scene), device=pair.device).repeat_interleave(rows_per_scene)

    def dealt(self, parts: int, generator: torch.Generator) -> list[Minibatch]:
        """Minibatches with every row in one of them, as many histories of each scene in each; shuffled anew.

        Fewer than `parts` where there are fewer histories.
        """
        first, _ = _runs(self.history)
        shuffled = torch.randperm(len(first), generator=generator, device=first.device)
        order = shuffled[torch.argsort(self.scene[first][shuffled], stable=True)]
        parts = min(parts, len(first))
        part_of = torch.empty_like(order)
        part_of[order] = torch.arange(len(order), device=order.device) % parts
        part = part_of[self.history]
        return [self._minibatch((part == number).nonzero()[:, 0]) for number in range(parts)]

    def _minibatch(self, index: Tensor) -> Minibatch:
        """The rows in index (B,) int64, ascending, which hold all rows of each of their histories."""
        first, pair_of = _runs(self.pair[index])
        padding = Padding.to_multiples(self.row_step, self._per_scene(index[first]), index.device)
        pairs = index[first][padding.rows]
        first_pair, history_of = _runs(self.history[pairs])
        histories = pairs[first_pair]
        repeated = histories[-1:].expand(-len(histories) % self.row_step)
        return Minibatch(
            rows=self.batch.rows(index, self._per_scene(index)),
            pair_of=padding.place[pair_of],
            target=self.batch.target[pairs],
            history_of=history_of,
            history=self.batch.history[torch.cat([histories, repeated])],
            pairs_per_scene=padding.rows_per_scene,
            pair_count=len(first),
            history_count=len(histories),
        )

    def _per_scene(self, index: Tensor) -> tuple[int, ...]:
        """How many of some rows lie in each scene."""
        return tuple(torch.bincount(self.scene[index], minlength=len(self.batch.rows_per_scene)).tolist())


def dealt_epochs(
    batch: Batch,
    state_count: int,
    target_count: int,
    *,
    epochs: int,
    parts: int,
    row_step: int,
    generator: torch.Generator,
) -> Iterator[list[Minibatch]]:
    """Every epoch's minibatches, see `Deck`; a batch that is learnt from whole, and once, stays as it is."""
    if epochs * parts == 1:
        yield [Minibatch.whole(batch)]
        return
    deck = Deck(batch, state_count, target_count, row_step)
    for _ in range(epochs):
        yield deck.dealt(parts, generator)


def _rank(keys: Tensor) -> Tensor:
    """The rank (B,) int64 of each key (B,) among those that differ."""
    return torch.unique(keys, return_inverse=True)[1]


def _runs(ascending: Tensor) -> tuple[Tensor, Tensor]:
    """Where each run of equal numbers begins, and the run of each number; (R,) and (B,) int64."""
    _, run, count = torch.unique_consecutive(ascending, return_inverse=True, return_counts=True)
    return count.cumsum(0) - count, run
