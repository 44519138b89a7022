"""Which commands and options there are, read from the commands' classes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import Field, fields, is_dataclass
from functools import cache
from typing import Any, get_args, get_origin, get_type_hints

import tyro


@cache
def subcommands(kind: object) -> dict[str, type]:
    """Commands by name of a union of them, or of a command that holds others; empty for one that holds none."""
    for part in _parts(kind):
        found = {config.name: member for member, config in _named(part)}
        if found:
            return found
    return {}


def command_of(words: Sequence[str], commands: object) -> tuple[type | None, int]:
    """The class of the command that some words begin with, and how many words name it; None where they name none."""
    kind, used = commands, 0
    while (inner := subcommands(kind)) and used < len(words) and words[used] in inner:
        kind, used = inner[words[used]], used + 1
    return (kind, used) if isinstance(kind, type) and not subcommands(kind) else (None, used)


def options(kind: type) -> dict[str, tuple[type, Field[Any]]]:
    """A command's options by name, without hyphens in front, each with the dataclass and field that hold it."""
    hints = get_type_hints(kind, include_extras=True)
    found: dict[str, tuple[type, Field[Any]]] = {}
    for own in fields(kind):
        if is_dataclass(hints[own.name]):
            found |= options(hints[own.name])
        else:
            found[option_name(own.name, hints[own.name])] = kind, own
    return found


def option_name(field: str, hint: object) -> str:
    """The option's name of a field, without hyphens in front."""
    given = (getattr(said, "name", None) for said in get_args(hint)[1:] if get_origin(hint) is not None)
    named = next((name for name in given if isinstance(name, str)), field)
    return named.replace("_", "-")


def _parts(kind: object) -> Iterator[object]:
    """What may be a union of commands: the kind itself, or the types of a command's fields."""
    if isinstance(kind, type) and is_dataclass(kind):
        yield from get_type_hints(kind, include_extras=True).values()
    else:
        yield kind


def _named(union: object) -> Iterator[tuple[type, Any]]:
    """The members of a union that are named as commands, each with what names it."""
    wanted = type(tyro.conf.subcommand("x"))
    for member in get_args(union):
        told = [said for said in get_args(member)[1:] if isinstance(said, wanted)]
        if told:
            yield get_args(member)[0], told[0]
