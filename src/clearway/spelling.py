"""Words as users write them: whole numbers, the text null in quotes, and names that are nearly right."""

from __future__ import annotations

from collections.abc import Iterable
from decimal import Decimal, InvalidOperation

NULL = "null"  # None
MOST_DIGITS = 18  # of a whole number; 1e999999999 would fill the memory


def whole_number(text: str) -> int:
    """The whole number of a text such as "600000", "600_000" or "6e5".

    Raises:
        ValueError: it is none; the message says what was expected.
    """
    expected = f"{text[:40]!r}: expected a whole number, such as 600000 or 6e5"
    try:
        return int(text)
    except ValueError:
        pass
    try:
        number = Decimal(text)
    except InvalidOperation:
        raise ValueError(expected) from None
    if not number.is_finite() or number.adjusted() > MOST_DIGITS or number != number.to_integral_value():
        raise ValueError(expected)
    return int(number)


def quoted(text: str) -> str:
    """The text so that `unquoted` gives it again, and that it is not `null`."""
    return f'"{text}"' if text == NULL or text != unquoted(text) else text


def unquoted(text: str) -> str:
    """The text `null` in double quotes, one pair or more, without one pair; another text as it is."""
    quotes = '"' * (len(text) - len(text.lstrip('"')))
    return text[1:-1] if quotes and text == f"{quotes}{NULL}{quotes}" else text


def nearest(word: object, names: Iterable[str]) -> str | None:
    """The name that a mistyped word most likely means; None where none is near."""
    from difflib import get_close_matches

    by_letters = {_letters(name): name for name in names}
    found = get_close_matches(_letters(word), by_letters, n=1, cutoff=0.7) if isinstance(word, str) else []
    return by_letters[found[0]] if found else None


def did_you_mean(word: object, names: Iterable[str]) -> str:
    """The sentence " Did you mean NAME?" for an error's message, with the blank before it; empty where none is near."""
    name = nearest(word, names)
    return f" Did you mean {name}?" if name else ""


def _letters(word: object) -> str:
    return str(word).lower().replace("_", "-")
