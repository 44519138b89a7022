"""Kinds of values that settings and records have, by the types of their fields."""

from __future__ import annotations

import math
import sys
from dataclasses import fields
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from clearway.errors import RunError

CALLED = {bool: "True or False", int: "a whole number", float: "a finite number", str: "a text"}
UNIONS = (UnionType, Union)


def field_types(kind: type) -> dict[str, Any]:
    """The types of a settings class's fields by name.

    Raises:
        RunError: one of them cannot be found where the class stands, or is none that a record holds.
    """
    names = {field.name for field in fields(kind)}
    found: dict[str, Any] = {}
    for owner in reversed(kind.__mro__):
        own = {name: text for name, text in vars(owner).get("__annotations__", {}).items() if name in names}
        fields_alone = type("Fields", (), {"__annotations__": own})  # types of what is no field may be unknown
        try:
            found |= get_type_hints(fields_alone, vars(sys.modules[owner.__module__]))
        except NameError as fault:
            raise RunError(f"{kind.__name__}: the type of a setting is unknown ({fault}). Import it there") from fault
    for name, wanted in found.items():
        if not _is_kept(wanted):
            allowed = "settings are numbers, True or False, texts, choices of texts, and None beside them"
            raise RunError(f"{kind.__name__}: {name} is of the type {called(wanted)}, and {allowed}. Change it")
    return found


def _is_kept(wanted: Any) -> bool:
    if get_origin(wanted) in UNIONS:
        return all(map(_is_kept, get_args(wanted)))
    if get_origin(wanted) is Literal:
        return all(isinstance(choice, str) for choice in get_args(wanted))
    return wanted in (*CALLED, type(None))


def fits(value: object, wanted: Any) -> bool:
    """Whether a value is of a setting's type: bool, int, str, float (any finite number), a choice or a union."""
    if get_origin(wanted) is Literal:
        return value in get_args(wanted)
    if get_origin(wanted) in UNIONS:
        return any(fits(value, one) for one in get_args(wanted))
    if wanted is float:
        return isinstance(value, int | float) and not isinstance(value, bool) and is_finite(value)
    return isinstance(value, wanted) and (wanted is bool or not isinstance(value, bool))


def is_finite(value: float) -> bool:
    """Whether a number is finite, and a whole one no larger than a float can be."""
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def called(wanted: Any) -> str:
    """A type in words, for errors."""
    if get_origin(wanted) is Literal:
        return " or ".join(map(repr, get_args(wanted)))
    if get_origin(wanted) in UNIONS:
        return " or ".join(map(called, get_args(wanted)))
    return CALLED.get(wanted, "None" if wanted is type(None) else getattr(wanted, "__name__", str(wanted)))
