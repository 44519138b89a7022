"""Minibatches in which everything that the network sees twice is computed once.

Trained agents come by the same way again and again, and many targets are walked to from the same poses: at the end of
the demo a minibatch holds 0.18 histories a row, and 0.34 pairs of a history and a target. Outputs depend on nothing
else. So rows of one history are dealt into the same minibatch, each pair is computed once, and its rows' gradients are
added up before they go back through the network. Nothing is approximated. Where the network computes round numbers of
rows faster, pairs and histories are repeated up to such a number; nothing is learnt from those.

Axis letters: B rows, P pairs, U histories, K history, A actions.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate

import torch
from torch import Tensor

from clearway.learn.losses import Batch
from clearway.learn.peers import ALONE, Peers
from clearway.model.padding import Padding
from clearway.model.sums import counted, sum_ascending

MOST_KINDS = 2**63 - 1  # that an int64 can tell apart


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
        peers: other workers' rows are dealt into the same minibatches.

    Attributes:
        batch: its rows in the new order.
        history, pair: (B,) int64, ascending: the rank of each row's history, and of its pair.
        first_of_history: (U,) int64, the first row of each history.
    """

    def __init__(
        self, batch: Batch, state_count: int, target_count: int, row_step: int = 1, peers: Peers = ALONE
    ) -> None:
        self.row_step = row_step
        slots = batch.history.flip(1).T  # newest first: states are numbered by scene, so sorting keeps scenes together
        history, kinds = slots[0], state_count
        for slot in slots[1:]:
            history, kinds = _joined(history, kinds, slot, state_count)
        pair, _ = _joined(history, kinds, batch.target, target_count)
        order = torch.argsort(pair, stable=True)
        self.batch = batch.rows(order, batch.rows_per_scene)
        self.first_of_history, self.history = _runs(history[order])
        _, self.pair = _runs(pair[order])
        rows_per_scene = torch.tensor(batch.rows_per_scene, device=pair.device)
        self.scene = torch.arange(len(rows_per_scene), device=pair.device).repeat_interleave(
            rows_per_scene, output_size=len(pair)
        )
        counts = [int(count) for [count] in peers.told(len(self.first_of_history))]
        self.all_histories, self.before = sum(counts), sum(counts[: peers.rank])  # of all workers, of those before

    def dealt(self, parts: int, generator: torch.Generator) -> list[Minibatch]:
        """Minibatches with every row in one of them, as many histories of each scene in each; shuffled anew.

        Fewer than `parts` where there are fewer histories.
        """
        first = self.first_of_history
        shuffled = torch.randperm(self.all_histories, generator=generator, device=first.device) - self.before
        if len(first) < self.all_histories:
            shuffled = shuffled[(shuffled >= 0) & (shuffled < len(first))]  # as one worker alone shuffles them
        order = shuffled[torch.argsort(self.scene[first][shuffled], stable=True)]
        parts = min(parts, self.all_histories)
        part_of = torch.empty_like(order)
        part_of[order] = (self.before + torch.arange(len(order), device=order.device)) % parts
        upto = [
            -(-(count - part) // parts) for part in range(parts) for count in (self.before, self.before + len(order))
        ]
        return self._divided(
            part_of[self.history], [last - first for first, last in zip(upto[::2], upto[1::2], strict=True)]
        )

    def _divided(self, part: Tensor, histories_per_part: Sequence[int]) -> list[Minibatch]:
        """A minibatch of the rows of each part (B,) int64, of which every history's rows are the same.

        All parts are made at once: no pair and no history is in two, and a GPU's host waits for some sizes once.
        """
        scene_count, parts = len(self.batch.rows_per_scene), len(histories_per_part)
        group = part * scene_count + self.scene
        order = torch.argsort(part, stable=True)
        first, pair_of = _runs(self.pair[order])
        pairs = order[first]
        groups = parts * scene_count
        rows_per_group, pairs_per_group = torch.stack([counted(group, groups), counted(group[pairs], groups)]).tolist()
        padding = Padding.to_multiples(self.row_step, pairs_per_group, part.device)
        pairs, pair_of = pairs[padding.rows], padding.place[pair_of]
        first_pair, history_of = _runs(self.history[pairs])
        histories = pairs[first_pair]
        row_counts, pair_counts, padded_counts = (
            [tuple(counts[first : first + scene_count]) for first in range(0, groups, scene_count)]
            for counts in (rows_per_group, pairs_per_group, padding.rows_per_scene)
        )
        rows = _slices(map(sum, row_counts))
        padded = _slices(map(sum, padded_counts))
        own = _slices(histories_per_part)
        return [
            Minibatch(
                rows=self.batch.rows(order[rows[number]], row_counts[number]),
                pair_of=pair_of[rows[number]] - padded[number].start,
                target=self.batch.target[pairs[padded[number]]],
                history_of=history_of[padded[number]] - own[number].start,
                history=self.batch.history[_with_the_last_repeated(histories[own[number]], self.row_step)],
                pairs_per_scene=padded_counts[number],
                pair_count=sum(pair_counts[number]),
                history_count=histories_per_part[number],
            )
            for number in range(parts)
        ]


def dealt_epochs(
    batch: Batch,
    state_count: int,
    target_count: int,
    *,
    epochs: int,
    parts: int,
    row_step: int,
    generator: torch.Generator,
    peers: Peers = ALONE,
) -> Iterator[list[Minibatch]]:
    """Every epoch's minibatches, see `Deck`; a batch that is learnt from whole, and once, stays as it is."""
    if epochs * parts == 1:
        yield [Minibatch.whole(batch)]
        return
    deck = Deck(batch, state_count, target_count, row_step, peers)
    for _ in range(epochs):
        yield deck.dealt(parts, generator)


def _joined(key: Tensor, kinds: int, last: Tensor, last_kinds: int) -> tuple[Tensor, int]:
    """One key for two, in lexicographic order: `key` (B,) int64 of [0, kinds), then `last` of [0, last_kinds).

    Returns:
        the key (B,) int64, and the number of values that it may take.
    """
    if kinds * last_kinds > MOST_KINDS:
        key, kinds = torch.unique(key, return_inverse=True)[1], len(key)
    return key * last_kinds + last, kinds * last_kinds


def _runs(ascending: Tensor) -> tuple[Tensor, Tensor]:
    """Where each run of equal numbers begins, and the run of each number; (R,) and (B,) int64."""
    _, run, count = torch.unique_consecutive(ascending, return_inverse=True, return_counts=True)
    return count.cumsum(0) - count, run


def _with_the_last_repeated(rows: Tensor, step: int) -> Tensor:
    """Rows (B,), up to a multiple of `step`."""
    return torch.cat([rows, rows[-1:].expand(-len(rows) % step)])


def _slices(counts: Iterable[int]) -> list[slice]:
    """Where so many numbers each stand, one after the other."""
    counts = list(counts)
    return [slice(last - count, last) for count, last in zip(counts, accumulate(counts), strict=True)]
