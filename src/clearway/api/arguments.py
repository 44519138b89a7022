"""Checks of what users hand to the functions of `clearway`, and plain Python values of it."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from numbers import Integral, Real
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from clearway.errors import ArgumentError
from clearway.learn.kinds import UNIONS, called, field_types
from clearway.learn.seeds import SEED_LIMIT
from clearway.spelling import did_you_mean

ACCEPTED: dict[Any, Any] = {int: Integral, float: Real, str: str}
"""What will do for a setting of a type, and becomes one."""


def as_path(name: str, value: object) -> Path:
    """A path from text or anything else that is one. Raises ArgumentError."""
    if isinstance(value, str | os.PathLike):
        path = os.fspath(value)
        if isinstance(path, str) and path:
            return Path(path)
    raise ArgumentError(f"{name}={value!r:.80}: expected a path, such as 'bathroom.h5'. Give a string or a Path")


def as_whole(name: str, value: object, lowest: int = 0, highest: int | None = None) -> int:
    """A whole number in a range, both ends included; Python's own or NumPy's. Raises ArgumentError."""
    inside = f"from {lowest} on" if highest is None else f"from {lowest} to {highest}"
    if not isinstance(value, Integral) or isinstance(value, bool):
        raise ArgumentError(f"{name}={value!r:.80}: expected a whole number {inside}. Give one")
    number = int(value)
    if number < lowest or (highest is not None and number > highest):
        raise ArgumentError(f"{name}={number}: expected a whole number {inside}. Give one in that range")
    return number


def as_workers(workers: object, ray: str | None) -> int:
    """How many processes train together; `ray` says where several do. Raises ArgumentError."""
    count = as_whole("workers", workers, 1)
    if ray is not None and count == 1:
        raise ArgumentError(f"ray={ray!r:.80}: says where several workers run. Give workers, 2 or more")
    return count


def as_seed(name: str, value: object) -> int:
    """A seed. Raises ArgumentError."""
    return as_whole(name, value, 0, SEED_LIMIT - 1)


def as_paths(name: str, sources: str | os.PathLike[str] | Iterable[str | os.PathLike[str]]) -> list[Path]:
    """A path, or several. Raises ArgumentError."""
    if isinstance(sources, str | os.PathLike):
        return [as_path(name, sources)]
    if not isinstance(sources, Iterable):
        raise ArgumentError(f"{name}={sources!r:.80}: expected a file, a folder, or several. Give one of these")
    if not (paths := [as_path(name, source) for source in sources]):
        raise ArgumentError(f"{name}: none given. Give at least one file or folder")
    return paths


def as_word(name: str, value: object) -> str:
    """A text. Raises ArgumentError."""
    if not isinstance(value, str):
        raise ArgumentError(f"{name}={value!r:.80}: expected a word. Give a string")
    return value


def as_size(name: str, value: object) -> tuple[int, int]:
    """Height and width. Raises ArgumentError."""
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != 2:
        raise ArgumentError(f"{name}={value!r:.80}: expected a height and a width, such as (96, 128). Give two numbers")
    return as_whole(name, value[0], 1), as_whole(name, value[1], 1)


def as_truth(name: str, value: object) -> bool:
    """True or False, Python's own or NumPy's. Raises ArgumentError."""
    return bool(_as(name, value, bool))


def as_choice(name: str, value: object, choices: tuple[str, ...]) -> str:
    """One of some words. Raises ArgumentError."""
    if not isinstance(value, str) or value not in choices:
        expected = f"expected one of {', '.join(map(repr, choices))}.{did_you_mean(value, choices)}"
        raise ArgumentError(f"{name}={value!r:.80}: {expected} Choose one")
    return value


def as_settings(kind: type, given: Mapping[str, object]) -> dict[str, Any]:
    """Settings of a config class, as plain values of its fields' types: a whole number will do for any number.

    Args:
        kind: a dataclass whose fields are numbers, truth values, words, choices of words, or None beside them.
        given: some of its fields by name.

    Raises:
        ArgumentError: there is no such setting, or its value is of another type.
    """
    types = field_types(kind)
    unknown = [name for name in given if name not in types]
    if unknown:
        raise ArgumentError(
            f"{unknown[0]}: no such setting.{did_you_mean(unknown[0], types)} Use one of {', '.join(types)}"
        )
    return {name: _as(name, value, types[name]) for name, value in given.items()}


def _as(name: str, value: object, wanted: Any) -> object:
    """The value as a bool, int, float, str, choice of words, None, or one of several of these."""
    if get_origin(wanted) in UNIONS:
        for one in get_args(wanted):
            with suppress(ArgumentError):
                return _as(name, value, one)
    elif get_origin(wanted) is Literal:
        return as_choice(name, value, get_args(wanted))
    elif wanted in ACCEPTED:
        if isinstance(value, ACCEPTED[wanted]) and not isinstance(value, bool):
            return wanted(value)
    elif wanted is bool:
        if isinstance(value, bool) or type(value).__name__ == "bool":  # NumPy's, too
            return bool(value)
    elif value is None:
        return None
    raise ArgumentError(f"{name}={value!r:.80}: expected {called(wanted)}. Correct it")
