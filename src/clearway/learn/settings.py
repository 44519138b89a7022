"""Single settings of the learner as words, such as "envs=200", for command lines."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, Literal, TypeVar, get_args, get_origin

from clearway.errors import RunError
from clearway.learn.algorithms import ALGORITHMS
from clearway.learn.kinds import UNIONS, field_types
from clearway.learn.learner import Learner, setting_names
from clearway.learn.plugged import faults_of
from clearway.learn.presets import PRESETS
from clearway.spelling import NULL, did_you_mean, unquoted, whole_number

Kind = TypeVar("Kind", bound=Learner)


def with_settings(learner: Kind, words: Sequence[str], called: str | None = None) -> Kind:
    """The learner with settings such as "envs=200" changed.

    Args:
        learner: to be changed.
        words: name=value each.
        called: by which name the user asked for the learner; None: its algorithm's.

    Raises:
        RunError: a word is not name=value or names no setting, its value has the wrong type, or the settings cannot
            work together.
    """
    types = field_types(type(learner))
    changes: dict[str, Any] = {}
    for word in words:
        name, equals, text = word.partition("=")
        if not equals or name not in types:
            names = f"a name among {called or learner.algorithm}'s settings: {', '.join(types)}"
            hint = _whose(name) if equals else ""
            hint = hint or did_you_mean(name, types)
            raise RunError(f"--set {word}: expected name=value with {names}.{hint} Correct it")
        try:
            changes[name] = _parsed(text, types[name])
        except ValueError as fault:
            raise RunError(f"--set {word}: expected {_expected(types[name])}. Correct it") from fault
    with faults_of(learner, "settings"):
        return replace(learner, **changes)


def _whose(name: str) -> str:
    """The sentence " NAME is a setting of LEARNERS.", of presets and algorithms of ours; empty where none has it."""
    kinds = {preset: type(learner) for preset, learner in PRESETS.items()} | ALGORITHMS
    found = [known for known, kind in kinds.items() if name in setting_names(kind)]
    return f" {name} is a setting of {', '.join(found)}." if found else ""


def _parsed(text: str, wanted: Any) -> object:
    """The value that a text means for a setting of that type; `null` in quotes is that text, else None, see `unquoted`.

    Raises:
        ValueError: it means none.
    """
    kinds = sorted(get_args(wanted) if get_origin(wanted) in UNIONS else [wanted], key=_is_text)
    if not _is_text(kinds[-1]):
        text = unquoted(text)
    for one in kinds:  # texts last, as anything is one
        with suppress(ValueError):
            return _value(unquoted(text) if _is_text(one) else text, one)
    raise ValueError(text)


def _value(text: str, wanted: Any) -> object:
    """The value that a text means for a type that is no union. Raises ValueError where it means none."""
    if wanted is str:
        return text
    if wanted in (int, float):
        return whole_number(text) if wanted is int else float(text)
    words = _words(wanted)
    if text not in words:
        raise ValueError(text)
    return words[text]


def _is_text(wanted: Any) -> bool:
    """The type's values are texts."""
    return wanted is str or get_origin(wanted) is Literal


def _words(wanted: Any) -> dict[str, object]:
    """The words of a type that has no others, with what they mean."""
    known: dict[Any, dict[str, object]] = {bool: {"true": True, "false": False}, type(None): {NULL: None}}
    return known.get(wanted) or {choice: choice for choice in get_args(wanted)}


def _expected(wanted: Any) -> str:
    """A type in words, for errors."""
    if get_origin(wanted) in UNIONS:
        return " or ".join(map(_expected, get_args(wanted)))
    return {int: "a whole number", float: "a number", str: "a text"}.get(wanted) or " or ".join(_words(wanted))
