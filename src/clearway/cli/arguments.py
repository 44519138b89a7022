"""What several commands read from the command line alike: numbers, scene files, targets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from clearway.errors import ClearwayError
from clearway.scenes.scene_files import SCENE_SUFFIXES, scene_files

if TYPE_CHECKING:
    from clearway.scenes.scene import Scene

__all__ = [
    "SCENE_SUFFIXES",
    "check_at_least",
    "check_ending",
    "check_finite",
    "check_named",
    "check_positive",
    "check_seeds",
    "chosen_targets",
    "scene_files",
]


def check_at_least(lowest: int, **values: int | None) -> None:
    """Check options by name, for example `step_cap=...` for --step-cap; None was not given. Raises ClearwayError."""
    for name, value in values.items():
        if value is not None and value < lowest:
            raise ClearwayError(f"{_option(name)} is {value}, expected at least {lowest}. Give a larger number")


def check_seeds(**seeds: int) -> None:
    """Check options that are seeds, by name. Raises ClearwayError."""
    from clearway.learn.seeds import SEED_LIMIT

    for name, seed in seeds.items():
        if not 0 <= seed < SEED_LIMIT:
            raise ClearwayError(f"{_option(name)} is {seed}, expected 0 to {SEED_LIMIT - 1}. Give a seed in that range")


def check_finite(**values: float | None) -> None:
    """Check that options, by name, are neither NaN nor infinite; None was not given. Raises ClearwayError."""
    for name, value in values.items():
        if value is not None and not math.isfinite(value):
            raise ClearwayError(f"{_option(name)} is {value}, expected a finite number. Correct it")


def check_positive(**values: float) -> None:
    """Check that options, by name, are finite and above 0. Raises ClearwayError."""
    for name, value in values.items():
        if not 0 < value < math.inf:
            raise ClearwayError(f"{_option(name)} is {value}, expected more than 0. Give a positive number")


def check_named(what: str, named: Sequence[object]) -> None:
    """Check that at least one thing of a kind, for example "folder", was named. Raises ClearwayError."""
    if not named:
        raise ClearwayError(f"no {what} given. Name at least one")


def check_ending(*endings: str, **paths: Path | None) -> None:
    """Check that files to be written, by option, have such endings: no other file is lost. Raises ClearwayError."""
    for name, path in paths.items():
        if path is not None and path.suffix.lower() not in endings:
            wanted = " or ".join(endings)
            raise ClearwayError(f"{path}: expected a name that ends in {wanted}. Give another {_option(name)}")


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def chosen_targets(scenes: Sequence[Scene], words: Sequence[str], seed: int) -> dict[str, tuple[int, ...]]:
    """Targets by scene name from the command line's words; scenes without any get their default ones.

    Raises:
        ClearwayError: a word cannot be read, names no scene given, or leaves open which scene it means.
    """
    from clearway.scenes.targets import default_targets

    names = [scene.name for scene in scenes]
    named: dict[str, tuple[int, ...]] = {}
    for word in words:
        name, equals, states = word.rpartition("=")
        if not equals:
            if len(scenes) > 1:
                raise ClearwayError(f"--targets {word}: several scenes are given. Write SCENE={word}")
            name = names[0]
        if name not in names:
            raise ClearwayError(f"--targets {word}: no scene of that name. Name one of {', '.join(names)}")
        try:
            named[name] = named.get(name, ()) + tuple(int(state) for state in states.split(","))
        except ValueError as error:
            raise ClearwayError(f"--targets {word}: expected state numbers such as 26,37,43. Correct it") from error
    return {scene.name: named.get(scene.name) or default_targets(scene, seed) for scene in scenes}
