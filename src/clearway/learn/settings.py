"""Single settings of the learner as words, such as "envs=200", for command lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from clearway.errors import RunError
from clearway.learn.learner import Learner
from clearway.spelling import did_you_mean, whole_number

Kind = TypeVar("Kind", bound=Learner)


def with_settings(learner: Kind, words: Sequence[str]) -> Kind:
    """The learner with settings such as "envs=200" changed.

    Raises:
        RunError: a word is not name=value or names no setting, its value has the wrong type, or the settings cannot
            work together.
    """
    known, types = asdict(learner), get_type_hints(type(learner))
    changes: dict[str, Any] = {}
    for word in words:
        name, equals, text = word.partition("=")
        if not equals or name not in known:
            names = f"a name among {learner.algorithm}'s settings: {', '.join(known)}"
            raise RunError(f"--set {word}: expected name=value with {names}.{did_you_mean(name, known)} Correct it")
        choices = get_args(types[name]) if get_origin(types[name]) is Literal else ()
        changes[name] = _parsed(word, text, known[name], choices)
    return replace(learner, **changes)


def _parsed(word: str, text: str, example: object, choices: tuple[str, ...]) -> object:
    """The value that `text` means for a setting with a value like `example`; `choices` are all there are, if any."""
    if isinstance(example, bool):
        choices = ("true", "false")
    if choices and text not in choices:
        raise RunError(f"--set {word}: expected {' or '.join(choices)}. Correct it")
    if isinstance(example, bool):
        return text == "true"
    if isinstance(example, str):
        return text
    assert isinstance(example, int | float)
    try:
        return whole_number(text) if isinstance(example, int) else float(text)
    except ValueError as error:
        kind = "a whole number" if isinstance(example, int) else "a number"
        raise RunError(f"--set {word}: expected {kind}. Correct it") from error
