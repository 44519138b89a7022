"""Files of settings in YAML, such as a run's `run.yaml`: read within limits, as plain values only, and written."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from clearway.errors import ClearwayError
from clearway.files import written_whole
from clearway.regular_files import read_bytes

MAX_BYTES = 8 * 1024**2  # the settings of a run on some 50,000 scenes
_Dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)  # several times as fast, where PyYAML comes with libyaml


MOST_DEEP = 20  # lists and mappings in each other
MOST_WORD_LETTERS = 100  # of a number, or of true, false and null: what is longer is a text
_Parser = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # the same, of events; what they mean is told below
_plain = yaml.SafeLoader("")  # knows what plain words are
_NUMBERS = {"tag:yaml.org,2002:int": _plain.construct_yaml_int, "tag:yaml.org,2002:float": _plain.construct_yaml_float}
_OTHERS = {"tag:yaml.org,2002:bool": _plain.construct_yaml_bool, "tag:yaml.org,2002:null": _plain.construct_yaml_null}


class _Reader:
    """Plain values of a YAML text: what has a tag, refers to another place or gives a key twice is refused.

    Dates, and numbers to the base of 60 such as 1:30, are texts.
    """

    def __init__(self, text: str) -> None:
        self._events = yaml.parse(text, _Parser)

    def whole(self) -> Any:
        """The one document's value; None where there is none. Raises YAMLError and ValueError."""
        next(self._events)
        event = next(self._events)
        if isinstance(event, yaml.StreamEndEvent):
            return None
        found = self._value(next(self._events), MOST_DEEP)
        next(self._events)
        if not isinstance(event := next(self._events), yaml.StreamEndEvent):
            raise _problem(event, "a second document, of which there is one here")
        return found

    def _value(self, event: yaml.Event, deep: int) -> Any:
        if isinstance(event, yaml.AliasEvent):
            raise _problem(event, "an alias (*), which is not read here")
        if event.tag is not None:
            raise _problem(event, f"the tag {event.tag[:40]}, which is not read here")
        if isinstance(event, yaml.ScalarEvent):
            return _word(event)
        if not deep:
            raise _problem(event, f"more than {MOST_DEEP} lists and mappings in each other")
        return self._mapping(deep) if isinstance(event, yaml.MappingStartEvent) else self._list(deep)

    def _list(self, deep: int) -> list[Any]:
        found = []
        while not isinstance(event := next(self._events), yaml.SequenceEndEvent):
            found.append(self._value(event, deep - 1))
        return found

    def _mapping(self, deep: int) -> dict[Any, Any]:
        found, texts = {}, set()
        while not isinstance(event := next(self._events), yaml.MappingEndEvent):
            key = self._value(event, deep - 1)
            if not isinstance(event, yaml.ScalarEvent):
                raise _problem(event, "a key that is no word")
            if event.value in texts:
                raise _problem(event, f"the key {event.value[:40]} occurs twice")
            texts.add(event.value)
            found[key] = self._value(next(self._events), deep - 1)
        return found


def _problem(event: yaml.Event, problem: str) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=event.start_mark)


def _word(event: yaml.ScalarEvent) -> Any:
    """The value of a word. Raises ValueError where it looks like a number and is none."""
    text = event.value
    if not event.implicit[0]:  # it stands in quotes
        return text
    return _meant(text) if len(text) <= MOST_WORD_LETTERS else text


@lru_cache(1 << 16)
def _meant(text: str) -> Any:
    kind = _plain.resolve(yaml.ScalarNode, text, (True, False))
    is_sexagesimal = kind in _NUMBERS and ":" in text
    meant = None if is_sexagesimal else (_NUMBERS | _OTHERS).get(kind)
    return text if meant is None else meant(yaml.ScalarNode(kind, text))


def read_settings(path: Path) -> dict[str, Any]:
    """What a YAML file of settings holds, by key; empty where it holds nothing.

    Raises:
        ClearwayError: there is no such file, it is too large, no YAML, or no mapping with words as keys.
    """
    try:
        content = read_bytes(path, MAX_BYTES)
    except OSError as fault:
        raise ClearwayError(f"{path}: not readable ({fault.strerror}). Name a YAML file of settings") from fault
    try:
        read = _Reader(content.decode("utf-8")).whole()
    except yaml.MarkedYAMLError as fault:
        where = f", line {fault.problem_mark.line + 1}" if fault.problem_mark else ""
        raise ClearwayError(f"{path}{where}: not read ({fault.problem}). Correct it") from fault
    except (yaml.YAMLError, ValueError) as fault:
        reason = " ".join(str(fault).split())[:200]
        raise ClearwayError(f"{path}: not read ({reason}). Correct it") from fault
    if read is None:
        return {}
    if not isinstance(read, dict) or not all(isinstance(key, str) for key in read):
        raise ClearwayError(f"{path}: expected an option a line, such as frames: 600000. Correct it")
    return read


def write_settings(path: Path, settings: Mapping[str, Any], head: str) -> None:
    """Write settings, plain values by key, under a comment."""
    text = yaml.dump(dict(settings), Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)
    with written_whole(path) as part:
        part.write_text("".join(f"# {line}\n" for line in head.splitlines()) + text, encoding="utf-8")
