"""The last K things an agent has seen, as part of its state.

Axis letters: B episodes, K history (newest last).
"""

from __future__ import annotations

import numpy as np


def history(earlier: np.ndarray, begun: np.ndarray, newest: np.ndarray) -> np.ndarray:
    """The last K things (B, K, ...) with the newest (B, ...), after the K - 1 `earlier` ones (B, K - 1, ...).

    Where an episode begins (`begun` (B,) is False), the newest fills it, as in the paper.
    """
    known = begun.reshape(-1, *[1] * newest.ndim)
    return np.concatenate([np.where(known, earlier, newest[:, None]), newest[:, None]], axis=1)
