"""What several commands read from the command line alike: numbers, scene files, targets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from clearway.choices import HELD_OUT
from clearway.errors import ClearwayError
from clearway.scenes.scene_files import SCENE_SUFFIXES, scene_files

__all__ = [
    "SCENE_SUFFIXES",
    "check_at_least",
    "check_ending",
    "check_finite",
    "check_named",
    "check_positive",
    "check_seeds",
    "given_targets",
    "scene_files",
]


def check_at_least(lowest: int, **values: int | None) -> None:
    """Check options by name, `step_limit=...` for --step-limit; None was not given. Raises ClearwayError."""
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


def given_targets(words: Sequence[str], scene_count: int) -> dict[str, list[int]] | list[int] | str | None:
    """Targets from the command line's words: state ids by scene name, or of the only scene; None where none are given.

    The word "held-out" alone stands for itself.

    Raises:
        ClearwayError: a word cannot be read, or leaves open which of several scenes it means.
    """
    if list(words) == [HELD_OUT]:
        return HELD_OUT
    named: dict[str, list[int]] = {}
    bare: list[int] = []
    for word in words:
        name, equals, text = word.rpartition("=")
        if not equals and scene_count > 1:
            raise ClearwayError(f"--targets {word}: several scenes are given. Write SCENE={word}")
        try:
            states = [int(state) for state in text.split(",")]
        except ValueError as error:
            raise ClearwayError(f"--targets {word}: expected state numbers such as 26,37,43. Correct it") from error
        (named.setdefault(name, []) if equals else bare).extend(states)
    if named and bare:
        raise ClearwayError(f"--targets {' '.join(words)}: some words name their scene. Name it in each, or in none")
    return named or bare or None
