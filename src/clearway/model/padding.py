"""Rows repeated so that every scene has a round number of them, and the shapes of matrix products recur.

oneDNN compiles a bfloat16 product anew for every shape that it has not met lately, which takes some 6 ms where the
product takes 0.5; float32 products are not compiled. Batches of learning have other sizes every time.

Axis letters: B rows, P rows with those that are repeated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

ROUND = 32  # rows; twice what Intel's matrix instructions take at a time


def row_step(dtype: torch.dtype) -> int:
    """Products of such factors are best made of a multiple of so many rows."""
    return ROUND if dtype == torch.bfloat16 else 1


def rounded_up(rows: int, step: int) -> int:
    """The next multiple of `step`."""
    return -(-rows // step) * step


@dataclass(frozen=True)
class Padding:
    """How rows, ordered by scene, are rounded up in number.

    Attributes:
        rows: (P,) int64, ascending: which row stands where; the last of a scene is repeated.
        place: (B,) int64, ascending: where each row stands first.
        rows_per_scene: how many there are then.
    """

    rows: Tensor
    place: Tensor
    rows_per_scene: tuple[int, ...]

    @classmethod
    def to_multiples(cls, step: int, rows_per_scene: Sequence[int], device: torch.device) -> Padding:
        """Every scene's rows, up to a multiple of `step`; of none there stay none."""
        if step == 1:  # as most are, and copying counts to a GPU would wait for it
            rows = torch.arange(sum(rows_per_scene), device=device)
            return cls(rows, rows, tuple(rows_per_scene))
        rounded = [rounded_up(count, step) for count in rows_per_scene]
        counts, places = torch.tensor([list(rows_per_scene), rounded], dtype=torch.int64, device=device)
        before, places_before = counts.cumsum(0) - counts, places.cumsum(0) - places
        scene = torch.arange(len(counts), device=device).repeat_interleave(places, output_size=sum(rounded))
        number = torch.arange(len(scene), device=device) - places_before[scene]
        rows = before[scene] + torch.minimum(number, counts[scene] - 1)
        shift = (places_before - before).repeat_interleave(counts, output_size=sum(rows_per_scene))
        return cls(rows, torch.arange(len(shift), device=device) + shift, tuple(rounded))
