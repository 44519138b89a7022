"""Kinds of values that settings and records have, by the types of their fields."""

from __future__ import annotations

import math
from types import UnionType
from typing import Any, Literal, get_args, get_origin

CALLED = {bool: "True or False", int: "a whole number", float: "a finite number", str: "a text"}


def fits(value: object, wanted: Any) -> bool:
    """Whether a value is of a setting's type: bool, int, str, float (any finite number), a choice or a union."""
    if get_origin(wanted) is Literal:
        return value in get_args(wanted)
    if get_origin(wanted) is UnionType:
        return any(fits(value, one) for one in get_args(wanted))
    if wanted is float:
        return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    return isinstance(value, wanted) and (wanted is bool or not isinstance(value, bool))


def called(wanted: Any) -> str:
    """A type in words, for errors."""
    if get_origin(wanted) is Literal:
        return " or ".join(map(repr, get_args(wanted)))
    if get_origin(wanted) is UnionType:
        return " or ".join(map(called, get_args(wanted)))
    return CALLED.get(wanted, "None" if wanted is type(None) else getattr(wanted, "__name__", str(wanted)))
