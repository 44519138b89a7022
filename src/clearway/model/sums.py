"""Sums of rows by what they belong to."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn.functional import embedding_bag


def sum_ascending(rows: Tensor, index: Tensor, count: int) -> Tensor:
    """Rows (B, H) added up by `index` (B,) int64, ascending, of [0, count): (count, H)."""
    return sum_listed(rows, torch.arange(len(rows), device=rows.device), torch.bincount(index, minlength=count))


def sum_listed(rows: Tensor, listed: Tensor, counts: Tensor) -> Tensor:
    """Rows (B, H) named by `listed` (L,) int64, added up in runs of `counts` (M,) int64: (M, H)."""
    return embedding_bag(listed, rows, counts.cumsum(0) - counts, mode="sum")
