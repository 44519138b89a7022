"""`--config FILE`: options of a command from a YAML file; what the command line gives goes before.

The file's values become words of the command line, which are then read as any others. Its keys are the options' names,
of positional arguments the fields' names, such as `files`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import tyro

from clearway.cli.known import command_of, options
from clearway.cli.reading import without_none
from clearway.errors import ClearwayError
from clearway.spelling import NULL, did_you_mean, quoted, whole_number

CONFIG = "config"
ADDED_TO = ("set",)  # options of single settings: the file's come first, and those of the command line change them


@dataclass(frozen=True)
class _Option:
    """An option as a file may give it: its name, the kind of its value without None, and whether it has no name."""

    name: str
    kind: Any
    positional: bool

    @property
    def takes_many(self) -> bool:
        """It takes as many words as there are."""
        return get_origin(self.kind) is tuple and get_args(self.kind)[-1] is ...


def with_config(words: Sequence[str], commands: object) -> list[str]:
    """The words with those of the file that `--config` names; as they are where it is not given.

    Args:
        words: the command line's.
        commands: the union of all commands' classes.

    Raises:
        ClearwayError: the file cannot be read, or holds a key or a value that the command does not take.
    """
    kind, used = command_of(words, commands)
    path, rest = _config_in(words[used:])
    if kind is None or path is None:
        return list(words)
    from clearway.settings_file import read_settings

    known = _options_of(kind)
    told = _checked(path, read_settings(path), known)
    given, positional = _given(rest, known)
    places = [option for option in known.values() if option.positional]
    named = [word for option in places[positional.count :] for word in told.get(option.name, ())]
    rest = [*rest[: positional.end], *named, *rest[positional.end :]]
    for name, values in told.items():
        option = known[name]
        if option.positional:
            continue
        if name in given:
            rest = _added(rest, name, values) if name in ADDED_TO else rest
        else:
            rest += _as_words(option, values)
    return [*words[:used], *rest]


def _config_in(words: Sequence[str]) -> tuple[Path | None, list[str]]:
    """The file that `--config` names, and the words without it."""
    rest, path = list(words), None
    for place, word in enumerate(words):
        if word == f"--{CONFIG}":
            if place + 1 == len(words):
                raise ClearwayError(f"--{CONFIG}: expected a file. Name a YAML file of settings")
            path, rest = Path(words[place + 1]), [*words[:place], *words[place + 2 :]]
            break
        if word.startswith(f"--{CONFIG}="):
            path, rest = Path(word.partition("=")[2]), [*words[:place], *words[place + 1 :]]
            break
    if any(word == f"--{CONFIG}" or word.startswith(f"--{CONFIG}=") for word in rest) and path is not None:
        raise ClearwayError(f"--{CONFIG}: given twice. Name one file")
    return path, rest


def _options_of(kind: type) -> dict[str, _Option]:
    found = {}
    for name, (owner, field) in options(kind).items():
        hint = get_type_hints(owner, include_extras=True)[field.name]
        plain, *said = get_args(hint) if get_origin(hint) is Annotated else (hint,)
        found[name] = _Option(name, _plain_kind(plain), tyro.conf.Positional in said)
    return found


def _plain_kind(kind: Any) -> Any:
    """The kind without None, choices as one, in a tuple too."""
    kind = without_none(kind)
    return tuple.__class_getitem__(tuple(map(_plain_kind, get_args(kind)))) if get_origin(kind) is tuple else kind


@dataclass(frozen=True)
class _Positional:
    """How many words without an option stand on the command line, and where the last of them ends."""

    count: int
    end: int


def _given(words: Sequence[str], known: Mapping[str, _Option]) -> tuple[set[str], _Positional]:
    """The options that words give, and their words that belong to none."""
    given: set[str] = set()
    left, count, end = 0.0, 0, 0  # words that belong to the option before
    for place, word in enumerate(words, 1):
        if word.startswith("--") and len(word) > 2:
            text, equals, _ = word[2:].partition("=")
            name = text.replace("_", "-")
            option = known.get(name) or known.get(name.removeprefix("no-"))
            if option is not None:
                given.add(option.name)
            left = 0.0 if equals or option is None else _words_of(option)
        elif left > 0:
            left -= 1
        else:
            count, end = count + 1, place
    return given, _Positional(count, end)


def _words_of(option: _Option) -> float:
    """How many words the option takes."""
    if option.takes_many:
        return float("inf")
    return 0 if option.kind is bool else len(get_args(option.kind)) if get_origin(option.kind) is tuple else 1


def _added(words: Sequence[str], name: str, values: Sequence[str]) -> list[str]:
    """The words with values before those that an option has there."""
    for place, word in enumerate(words):
        option, equals, own = word.partition("=")
        if option == f"--{name}":
            first = [own] if equals else []
            return [*words[:place], option, *values, *first, *words[place + 1 :]]
    return list(words)


def _as_words(option: _Option, values: Sequence[str]) -> list[str]:
    """An option of the command line."""
    if option.kind is bool:
        return [f"--{option.name}" if values[0] == "true" else f"--no-{option.name}"]
    return [f"--{option.name}", *values] if get_origin(option.kind) is tuple else [f"--{option.name}={values[0]}"]


def _checked(path: Path, content: Mapping[str, Any], known: Mapping[str, _Option]) -> dict[str, list[str]]:
    """The file's values as words, by option. Raises ClearwayError, which names file and key."""
    told: dict[str, list[str]] = {}
    for key, value in content.items():
        name = key.replace("_", "-")
        if name not in known:
            hint = did_you_mean(name, known) or f" Choose among {', '.join(known)}."
            raise ClearwayError(f"{path}: {key[:60]}: no such option of this command.{hint} Correct the file")
        if name in told:
            raise ClearwayError(f"{path}: {key}: occurs twice, once with _ and once with -. Remove one")
        if value is None:
            continue  # as where it is left out
        try:
            told[name] = list(_words(known[name], value))
        except ValueError as fault:
            end = "" if str(fault).endswith("?") else "."
            raise ClearwayError(f"{path}: {key}: {fault}{end} Correct the file") from fault
    return told


def _words(option: _Option, value: object) -> Iterator[str]:
    """A value as words. Raises ValueError, which says what was expected."""
    if get_origin(option.kind) is tuple:
        inner, *others = get_args(option.kind)
        if isinstance(value, dict):
            yield from _named_values(inner, value, are_settings=option.name in ADDED_TO)
            return
        values = value if isinstance(value, list) else [value]
        if others[-1] is not ... and len(values) != 1 + len(others):
            raise ValueError(f"found {len(values)} values, expected {1 + len(others)}")
        for each in values:
            word = _word(inner, each)
            if word.startswith("--"):
                raise ValueError(f"found {_shown(word)}, which reads as an option")
            yield word
    else:
        yield _word(option.kind, value)


def _named_values(inner: Any, value: Mapping[Any, object], *, are_settings: bool) -> Iterator[str]:
    """A mapping, {envs: 200}, as words such as envs=200, for options that take such words.

    The text null of a setting stands in quotes, as `learn.settings` reads it, which knows whether it can be a text.
    """
    if inner is not str:
        raise ValueError("found a mapping, expected a list")
    for name, each in value.items():
        if are_settings and isinstance(each, str):
            yield f"{_word(str, name)}={quoted(each)}"
        else:
            parts = each if isinstance(each, list) else [each]
            yield f"{_word(str, name)}={','.join(map(_bare, parts))}"


def _bare(value: object) -> str:
    """A value as the part of a word."""
    if value is None:
        return NULL
    return str(value).lower() if isinstance(value, bool) else _word(str, value)


def _word(kind: Any, value: object) -> str:
    """One value as a word."""
    if get_origin(kind) is Literal:
        choices = get_args(kind)
        text = value if isinstance(value, str) else repr(value) if isinstance(value, int) else ""
        if text not in map(str, choices):
            hint = did_you_mean(value, map(str, choices))
            told = ", ".join(map(str, choices)) + (f".{hint}" if hint else "")
            raise ValueError(f"found {_shown(value)}, expected one of {told}")
        return text
    expected = {bool: "true or false", int: "a whole number", float: "a number"}.get(kind, "a text")
    problem = f"found {_shown(value)}, expected {expected}"
    if kind is bool:
        if not isinstance(value, bool):
            raise ValueError(problem)
        return str(value).lower()
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        quoted = ", in quotes" if expected == "a text" and not isinstance(value, list | dict) else ""
        raise ValueError(problem + quoted)
    try:
        if kind is int:
            return str(whole_number(str(value)))
        if kind is float:
            float(value)
    except ValueError:
        raise ValueError(problem) from None
    if kind is Path and not isinstance(value, str):
        raise ValueError(f"{problem}, in quotes")
    return str(value)


def _shown(value: object) -> str:
    """A value in an error's message."""
    if isinstance(value, list | dict):
        return "a list" if isinstance(value, list) else "a mapping"
    return repr(value)[:40]
