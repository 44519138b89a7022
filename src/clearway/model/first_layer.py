"""The siamese layer on a world's states, without its bias and ReLU: rows are projected once and then looked up.

Two ways to the same numbers, up to rounding. `AllStates` projects every state whenever the weight moves: the less work
the fewer states there are. `VisitedStates` projects the states that occur: memory and work follow the batch, not the
world. Which one is taken says `lookup.projects_all`.

Axis letters: B rows, K history, S states, F features, H width, M targets, U states that occur.
"""

from __future__ import annotations

from copy import copy
from typing import Protocol

import torch
from torch import Tensor
from torch.nn.functional import embedding_bag

from clearway.model.padding import rounded_up, row_step
from clearway.model.sums import counted, multiply, sum_listed

MOST_ROWS = 131_072  # projected states kept while nothing is being learnt from them: 1 GiB at the published size


class FirstLayer(Protocol):
    """What both ways offer. Results are sums over the K slots, before bias and ReLU, in the dtype of the factors."""

    def for_targets(self, target_state: Tensor) -> FirstLayer:
        """The same layer, its tables shared, with other targets (M,) int64; to look up, not to learn."""

    def refresh(self, keep: bool) -> None:
        """The weight has changed; `keep`: the states that occurred since the last time will occur again."""

    def seen(self, history: Tensor) -> Tensor:
        """(B, H) of histories (B, K) int64."""

    def wanted(self, targets: Tensor) -> Tensor:
        """(U, H) of targets (U,) int64, each in every slot."""

    def starts(self, state: Tensor) -> tuple[Tensor, Tensor]:
        """Sums (U, H) of states in every slot, and which of them is that of each state (B,) int64: (B,) int64."""

    def add(self, history: Tensor, grad_seen: Tensor, grad_wanted: Tensor, begin: bool) -> None:
        """Add up what the weight's gradient needs, from those of `seen` (B, H) and `wanted` (M, H).

        `begin`: forget what was added before.
        """

    def gradient(self, out: Tensor) -> None:
        """Write the weight's gradient (K, H, F), of all that was added."""


class AllStates:
    """All states are projected, whenever the weight moves.

    Args:
        weight: (K, H, F), shared, not copied. Call `refresh` first, and after every change.
        features: (S, F).
        target_state: (M,) int64.
        dtype: of the factors of matrix products and of what is projected; gradients have the weight's.
    """

    def __init__(self, weight: Tensor, features: Tensor, target_state: Tensor, dtype: torch.dtype) -> None:
        self.weight, self.features, self.target_state = weight, features.to(dtype).contiguous(), target_state
        self.history_length, self.width, _ = weight.shape
        self.slot = torch.arange(self.history_length, device=features.device)
        columns = self.history_length * self.width
        self.projected = self.features.new_empty(len(features), columns)
        self.by_state = weight.new_empty(0, columns)

    def for_targets(self, target_state: Tensor) -> AllStates:
        """See `FirstLayer`."""
        other = copy(self)
        other.target_state = target_state
        return other

    def refresh(self, keep: bool) -> None:
        """The weight has changed; `keep` makes no difference here."""
        weight = self.weight.flatten(0, 1).to(self.features.dtype)
        torch.mm(self.features, weight.T, out=self.projected)  # (S, K * H)

    def seen(self, history: Tensor) -> Tensor:
        """(B, H) of histories (B, K) int64."""
        return embedding_bag(self._table_row(history), self.projected.view(-1, self.width), mode="sum")

    def wanted(self, targets: Tensor) -> Tensor:
        """(U, H) of targets (U,) int64, each in every slot."""
        return self.projected[self.target_state[targets]].view(-1, self.history_length, self.width).sum(1)

    def starts(self, state: Tensor) -> tuple[Tensor, Tensor]:
        """Sums (S, H) of all states in every slot, and `state` (B,) int64 as it is."""
        return self.projected.view(-1, self.history_length, self.width).sum(1), state

    def add(self, history: Tensor, grad_seen: Tensor, grad_wanted: Tensor, begin: bool) -> None:
        """Add gradients up by state and slot, (S, K * H)."""
        bag = self._table_row(history).flatten()
        count = counted(bag, len(self.features) * self.history_length)
        sample = torch.argsort(bag) // self.history_length
        by_state = sum_listed(grad_seen, sample, count)  # (S * K, H)
        columns = by_state.view(len(self.features), -1).to(self.weight.dtype)
        self.by_state = columns if begin else self.by_state.add_(columns)
        self.by_state.index_add_(0, self.target_state, grad_wanted.repeat(1, self.history_length))

    def gradient(self, out: Tensor) -> None:
        """Write the weight's gradient (K, H, F), of all that was added."""
        multiply(self.by_state.to(self.features.dtype).T, self.features, out=out.flatten(0, 1))

    def _table_row(self, states: Tensor) -> Tensor:
        """Row of `projected`, seen as (S * K, H), for states (B, K) in their slots."""
        return states * self.history_length + self.slot


class VisitedStates:
    """States are projected when they occur, and forgotten when another batch begins.

    A target stands in every slot, so that the sum of the slots' weights serves it, and likewise a start.

    Args:
        weight: (K, H, F), shared, not copied. Call `refresh` first, and after every change.
        features: (S, F) in any store and float dtype; rows are read as they are needed.
        target_state: (M,) int64.
        dtype: as of `AllStates`.

    Attributes:
        known: number of states projected at present.
        row_of: (S,) int64, their rows; -1 of all other states.
    """

    def __init__(self, weight: Tensor, features: Tensor, target_state: Tensor, dtype: torch.dtype) -> None:
        self.weight, self.features, self.dtype, self.row_step = weight, features, dtype, row_step(dtype)
        self.history_length, self.width, count = weight.shape
        columns, device = self.history_length * self.width, features.device
        self.slot = torch.arange(self.history_length, device=device)
        self.row_of = torch.full((len(features),), -1, device=device)
        self.known = 0
        self.rows = torch.empty(0, count, dtype=dtype, device=device)  # features of the known states
        self.projected = torch.empty(0, columns, dtype=dtype, device=device)
        self.targets = self._read(target_state)  # (M, F)
        self.by_state, self.by_target = weight.new_empty(0, columns), weight.new_empty(0, self.width)

    def for_targets(self, target_state: Tensor) -> VisitedStates:
        """See `FirstLayer`; states are projected by the layer that they are asked of."""
        other = copy(self)
        other.row_of, other.known, other.targets = torch.full_like(self.row_of, -1), 0, self._read(target_state)
        other.rows, other.projected = self.rows[:0], self.projected[:0]
        return other

    def refresh(self, keep: bool) -> None:
        """The weight has changed; `keep` the states that are known and project them anew."""
        self.rounded = self.weight.flatten(0, 1).to(self.dtype)
        if keep:
            self._project_rows(0, self.known)
        else:
            self._forget()
        self.by_state = self.by_state[:0]
        self.slots_together = self.weight.sum(0).to(self.dtype)  # (H, F)

    def seen(self, history: Tensor) -> Tensor:
        """(B, H) of histories (B, K) int64."""
        row = self._table_row(history)
        return embedding_bag(row, self.projected[: self.known].view(-1, self.width), mode="sum")

    def wanted(self, targets: Tensor) -> Tensor:
        """(U, H) of targets (U,) int64, each in every slot."""
        return self.targets[targets] @ self.slots_together.T

    def starts(self, state: Tensor) -> tuple[Tensor, Tensor]:
        """Sums (U, H) of the states that occur, in every slot, and the row of each state (B,) int64 among them."""
        states, row = torch.unique(state, return_inverse=True)
        return self._read(states) @ self.slots_together.T, row

    def add(self, history: Tensor, grad_seen: Tensor, grad_wanted: Tensor, begin: bool) -> None:
        """Add gradients up by known state and slot, (U, K * H), and by target."""
        bag = self._table_row(history).flatten()
        order = torch.argsort(bag)
        occupied, count = torch.unique_consecutive(bag[order], return_counts=True)
        sums = sum_listed(grad_seen, order // self.history_length, count)
        before = 0 if begin else len(self.by_state)
        if before < self.known:
            grown = self.weight.new_zeros(rounded_up(self.known, self.row_step), self.projected.shape[1])
            grown[:before] = self.by_state[:before]
            self.by_state = grown
        self.by_state.view(-1, self.width).index_add_(0, occupied, sums.to(self.weight.dtype))
        self.by_target = grad_wanted if begin else self.by_target + grad_wanted

    def gradient(self, out: Tensor) -> None:
        """Write the weight's gradient (K, H, F), of all that was added."""
        multiply(self.by_state.to(self.dtype).T, self.rows[: len(self.by_state)], out=out.flatten(0, 1))
        occurred = self.by_target.any(1).nonzero()[:, 0]
        out.add_(self.by_target[occurred].to(self.dtype).T @ self.targets[occurred])

    def _table_row(self, states: Tensor) -> Tensor:
        """Row of `projected`, seen as (U * K, H), for states (B, K) in their slots; projects what is missing."""
        row = self.row_of[states]
        missing = states[row < 0].unique()
        if len(missing):
            if self.known + len(missing) > MOST_ROWS and not len(self.by_state):
                self._forget()
                missing = states.unique()
            self._project(missing)
            row = self.row_of[states]
        return row * self.history_length + self.slot

    def _project(self, states: Tensor) -> None:
        """Make states (U,) known."""
        first, last = self.known, self.known + len(states)
        room = rounded_up(first + rounded_up(len(states), self.row_step), self.row_step)
        self.rows, self.projected = _with_room(self.rows, first, room), _with_room(self.projected, first, room)
        self.rows[first:last] = self._read(states)
        self._project_rows(first, last)
        self.row_of[states] = torch.arange(first, last, device=states.device)
        self.known = last

    def _project_rows(self, first: int, last: int) -> None:
        """Project the features in rows first to last, last excluded, and some rows more that nobody reads."""
        rows = slice(first, first + rounded_up(last - first, self.row_step))
        torch.mm(self.rows[rows], self.rounded.T, out=self.projected[rows])

    def _forget(self) -> None:
        self.row_of.fill_(-1)
        self.known = 0

    def _read(self, states: Tensor) -> Tensor:
        """Features (U, F) of states (U,)."""
        return self.features[states].to(self.dtype)


def _with_room(table: Tensor, used: int, rows: int) -> Tensor:
    """The table, or a larger one with its first `used` rows, so that it has so many rows; doubled when it grows."""
    if rows <= len(table):
        return table
    larger = table.new_zeros(max(rows, 2 * len(table)), table.shape[1])
    larger[:used] = table[:used]
    return larger
