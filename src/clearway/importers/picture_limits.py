"""How many pictures an importer may take: they are held in memory until they are encoded."""

from __future__ import annotations

from pathlib import Path

from clearway.errors import SceneError
from clearway.scenes.validate import MAX_PICTURE_SIDE, MAX_STATES

MAX_PICTURE_BYTES = 4 << 30  # of all pictures of a scene


def check_picture_size(source: str | Path, height_px: int, width_px: int) -> None:
    """Refuse pictures that scene files cannot hold. Raises SceneError."""
    if not all(1 <= side <= MAX_PICTURE_SIDE for side in (height_px, width_px)):
        problem = f"pictures of {width_px} x {height_px} pixels, expected sides of 1 to {MAX_PICTURE_SIDE}"
        raise SceneError(source, problem, "Give another --height and --width")


def check_picture_count(
    source: str | Path, states: int, height_px: int, width_px: int, fewer: str, pose_bytes: int | None = None
) -> None:
    """Refuse more poses or pictures than fit. Raises SceneError.

    Args:
        source: the file, for the error.
        states: number of poses.
        height_px, width_px: of a picture.
        fewer: says how to have fewer.
        pose_bytes: what all sensors take at a pose; None: a colour picture.
    """
    if states > MAX_STATES:
        raise SceneError(source, f"has {states} poses on free cells, expected at most {MAX_STATES}", fewer)
    size = states * (height_px * width_px * 3 if pose_bytes is None else pose_bytes)
    if size > MAX_PICTURE_BYTES:
        problem = f"{states} pictures of {width_px} x {height_px} pixels take {size >> 20} MiB of memory"
        remedy = f"{fewer}, or a smaller --height and --width"
        raise SceneError(source, f"{problem}, expected at most {MAX_PICTURE_BYTES >> 20}", remedy)
