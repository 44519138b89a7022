"""All hostile files, made on the spot, always the same in the same order."""

from __future__ import annotations

from collections.abc import Iterator

from hostile import odd_files, other_files, scene_files, settings_files
from hostile.cases import Case


def cases(flips: int) -> Iterator[Case]:
    """Every case; `flips` is the number of bits flipped in a scene file of ours, one a file."""
    yield from scene_files.cases(flips)
    yield from other_files.cases(flips)
    yield from settings_files.cases()
    yield from odd_files.cases()
