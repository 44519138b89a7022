"""Sums of rows, by what they belong to or all of them, and products; results may have another dtype."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn.functional import embedding_bag


def sum_ascending(rows: Tensor, index: Tensor, count: int) -> Tensor:
    """Rows (B, H) added up by `index` (B,) int64, ascending, of [0, count): (count, H)."""
    return sum_listed(rows, torch.arange(len(rows), device=rows.device), counted(index, count))


def counted(index: Tensor, count: int) -> Tensor:
    """How often each number of [0, count) stands in `index` (B,) int64: (count,); `bincount` lets a GPU's host wait."""
    return index.new_zeros(count).scatter_add_(0, index, torch.ones_like(index))


def sum_listed(rows: Tensor, listed: Tensor, counts: Tensor) -> Tensor:
    """Rows (B, H) named by `listed` (L,) int64, added up in runs of `counts` (M,) int64: (M, H)."""
    return embedding_bag(listed, rows, counts.cumsum(0) - counts, mode="sum")


def add_up(rows: Tensor, out: Tensor) -> Tensor:
    """Write the sum of all rows (B, H) to `out` (H,), added up in its dtype."""
    return torch.sum(rows, 0, dtype=out.dtype, out=out)


def multiply(left: Tensor, right: Tensor, out: Tensor) -> None:
    """Write the matrix product of two matrices of one dtype to `out`, of any."""
    if out.dtype == left.dtype:
        torch.mm(left, right, out=out)
    else:
        out.copy_(left @ right)
