"""The argument parser's refusals, in one line."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr
from typing import get_args, get_type_hints

from clearway.cli.help_text import help_wrapped
from clearway.cli.known import command_of, options, subcommands
from clearway.cli.reading import without_none
from clearway.errors import ClearwayError
from clearway.spelling import did_you_mean

CORNERS = ("╭", "╰")
LENGTHY = ("Perhaps you meant", "Argument helptext")  # parts of a refusal that --help says better
_UNKNOWN = re.compile(r"Unrecognized options: (.+)")
_ASTRAY = re.compile(r"Unrecognized or misplaced options: (.+? \(applied to [^)]+\))(?=\.|$)")
_APPLIED = re.compile(r" \(applied to [^)]+\) ?")
_FULL_HELP = re.compile(r"For full helptext, (?:run|see):? .*$")
_NO_CHOICE = re.compile(r"invalid choice '(.*)' for argument ")


@contextmanager
def refusals_in_one_line(words: Sequence[str], commands: object) -> Iterator[None]:
    """Turn the frame that tyro prints about words it cannot read into a `ClearwayError`; help is printed as ever.

    Args:
        words: that are read.
        commands: the union of all commands' classes.
    """
    said = io.StringIO()
    try:
        with redirect_stderr(said), help_wrapped():
            yield
    except SystemExit as leaving:
        if not leaving.code:
            raise
        refused = _plain(_FULL_HELP.sub("", one_line(said.getvalue())))
        named = " ".join(["clearway", *words[: command_of(words, commands)[1]]])
        raise ClearwayError(f"{_with_suggestion(refused, words, commands).strip()} Help: {named} --help") from leaving


def _plain(refused: str) -> str:
    """A refusal that names unknown options alone, where tyro says of each word what it was applied to."""
    if found := _ASTRAY.match(refused):
        words = [word for word in _APPLIED.split(found[1]) if word]
        return f"Unrecognized options: {', '.join(words)}{refused[found.end() :]}"
    return refused


def _with_suggestion(refused: str, words: Sequence[str], commands: object) -> str:
    """A refusal with the name that was probably meant, where there is one."""
    if choice := _choice_without_option(refused, words, commands):
        return f"{refused.rstrip('. ')}. Did you mean {choice}?"
    told, _, rest = refused.partition(". ")
    for pattern, names in ((_UNKNOWN, _names_there(words, commands)), (_NO_CHOICE, _choices(refused))):
        if found := pattern.match(told):
            word = next((part for part in found[1].split(", ") if part.startswith("--")), found[1].split(", ")[0])
            return f"{told}.{did_you_mean(word.split('=')[0], names)} {rest}"
    return refused


def _choice_without_option(refused: str, words: Sequence[str], commands: object) -> str:
    """The option with its value, where a word that was not recognised is one of an option's choices."""
    kind, used = command_of(words, commands)
    found = _UNKNOWN.search(refused)
    if kind is None or found is None:
        return ""
    for word in words[used:]:
        if word not in re.split(r"[, .]+", found[1]):
            continue
        for name, (owner, field) in options(kind).items():
            if word in get_args(without_none(get_type_hints(owner)[field.name])):
                return f"--{name} {word}"
    return ""


def _names_there(words: Sequence[str], commands: object) -> list[str]:
    """What can stand where some words go astray: options of the command that they name, or commands."""
    kind, used = command_of(words, commands)
    if kind is not None:
        return [f"--{name}" for name in (*options(kind), "config")]
    group = commands
    for word in words[:used]:
        group = subcommands(group)[word]
    return list(subcommands(group))


def _choices(refused: str) -> Iterable[str]:
    """The choices that a refusal lists."""
    listed = re.search(r"Expected one of \((.*?)\)", refused)
    return re.findall(r"'([^']*)'", listed[1]) if listed else ()


def one_line(framed: str) -> str:
    """What a framed message says: the beginning of each of its parts, which rules divide."""
    from rich.text import Text

    rows = Text.from_ansi(framed).plain.splitlines()
    inside = "\n".join(row.strip("│ ") for row in rows if not row.startswith(CORNERS))
    parts = [" ".join(part.strip().split("\n\n")[0].split()) for part in re.split("─{3,}|-{10,}", inside)]
    if len(parts) > 1 and not any(row.startswith(CORNERS) for row in rows):
        parts = parts[1:]  # a terminal without the letters for frames: the first part is the title
    return ". ".join(part.rstrip(".") for part in parts if part and not part.startswith(LENGTHY))
