"""Figures of an update, by name: each algorithm's own, see docs/metrics.md."""

from __future__ import annotations

import math
from collections.abc import Mapping

from clearway.errors import RunError

Figures = dict[str, float]


def check_finite(figures: Mapping[str, float], frames: int) -> None:
    """Stop where an update, the last of so many frames, has gone astray.

    Raises:
        RunError: a figure is not finite.
    """
    for name, value in figures.items():
        if not math.isfinite(value):
            raise RunError(
                f"the {name.replace('_', ' ')} is {value} after {frames} frames. Training stopped; "
                "lower the learning rate or check the features"
            )
