"""Whether pictures have the aspect that those of a training had."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from clearway.scenes.scene import Scene

SLACK = 0.02  # share by which aspects may differ


class AspectWarning(UserWarning):
    """Pictures have another aspect than those of the training."""


def other_aspect(given_px: tuple[int, int], trained_px: tuple[int, int]) -> str | None:
    """What is to be told of pictures (height, width) whose aspect is not the trained one; None where it is.

    Pictures are squashed to the size of a training's, so that another size is the same picture, another aspect is not.
    """
    (height, width), (trained_height, trained_width) = given_px, trained_px
    aspect, trained = width / height, trained_width / trained_height
    if abs(aspect / trained - 1) <= SLACK:
        return None
    crop = (round(height * trained), height) if aspect > trained else (width, round(width / trained))
    return (
        f"pictures of {width} x {height} pixels have the aspect {aspect:.2f}, those of the training {trained:.2f} "
        f"({trained_width} x {trained_height}), so that they would be seen squashed. "
        f"Crop them to {crop[0]} x {crop[1]}"
    )


def warn_of_aspect(scenes: Sequence[Scene], trained_px: tuple[int, int], stacklevel: int = 2) -> None:
    """Warn (AspectWarning) of scenes whose pictures have another aspect than the trained one (height, width).

    Once for all scenes of one kind of picture.
    """
    found: dict[str, list[str]] = {}
    for scene in scenes:
        if scene.observations is not None:
            _, height, width, _ = scene.observations.shape
            if problem := other_aspect((height, width), trained_px):
                found.setdefault(problem, []).append(scene.name)
    for problem, (first, *others) in found.items():
        where = f"scene {first}" + (f" and {len(others)} more" if others else "")
        warnings.warn(f"{where}: {problem}", AspectWarning, stacklevel=stacklevel + 1)
