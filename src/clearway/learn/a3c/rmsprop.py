"""A3C's shared RMSProp, several workers' updates in one pass through memory.

    ms <- alpha ms + (1 - alpha) g^2;   parameter <- parameter - lr g / sqrt(ms + epsilon)

as in `learn.optimiser.SharedRMSProp`, one worker's update after the other. But a block of parameters that fits the
cache takes all updates of a process's workers before the next block is read, so that main memory is crossed once for
all of them; and a worker's gradient is written out only for that block, from its thin factors. What is stored is
ms + epsilon, which obeys the same recursion with (1 - alpha) epsilon added and saves a pass.

Nothing is locked: two processes that write the same block at once may lose a part of an update, as in the published
A3C (Mnih et al., 2016, section 4; Recht et al., 2011).

Axis letters: R workers, J rows of the factors, O by I a weight.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from clearway.learn.optimiser import ALPHA, EPSILON

BLOCK_ELEMENTS = 32 * 1024  # four arrays of 128 kB are at work at a time: they fit a level-2 cache of 1 MB


class SharedRMSPropUpdate:
    """Applies updates to shared parameters.

    Args:
        alpha, epsilon: see above.
    """

    def __init__(self, alpha: float = ALPHA, epsilon: float = EPSILON) -> None:
        self.alpha = alpha
        self.added = torch.tensor((1 - alpha) * epsilon)

    @torch.no_grad()
    def low_rank(self, weight: Tensor, square: Tensor, left: Tensor, right: Tensor, lr: Sequence[float]) -> None:
        """Apply gradients left[r]^T right[r] in order.

        Args:
            weight, square: (O, I) parameters, and their mean squares plus epsilon.
            left, right: (R, J, O), (R, J, I).
            lr: R learning rates.
        """
        inputs = weight.shape[1]
        rows = max(1, BLOCK_ELEMENTS // inputs)
        gradient, root = torch.empty(rows, inputs), torch.empty(rows, inputs)
        rights = right.unbind(0)
        lefts = left.transpose(1, 2).split(rows, 1)  # (R, rows, J) each
        for block_weight, block_square, block_left in zip(weight.split(rows), square.split(rows), lefts, strict=True):
            block = slice(0, len(block_weight))
            block_gradient, block_root = gradient[block], root[block]
            for own_left, own_right, rate in zip(block_left.unbind(0), rights, lr, strict=True):
                torch.mm(own_left, own_right, out=block_gradient)
                self._step(block_weight, block_square, block_gradient, block_root, rate)

    @torch.no_grad()
    def dense(self, parameter: Tensor, square: Tensor, gradients: Tensor, lr: Sequence[float]) -> None:
        """Apply gradients (R, ...) in order to a small parameter (...)."""
        root = torch.empty_like(parameter)
        for gradient, rate in zip(gradients, lr, strict=True):
            self._step(parameter, square, gradient, root, rate)

    def _step(self, parameter: Tensor, square: Tensor, gradient: Tensor, root: Tensor, lr: float) -> None:
        torch.add(self.added, square, alpha=self.alpha, out=square)
        square.addcmul_(gradient, gradient, value=1 - self.alpha)
        torch.sqrt(square, out=root)
        parameter.addcdiv_(gradient, root, value=-lr)
