"""A reward as a run's record holds it, read again; `Reward.to_json` wrote it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from clearway.reward import REWARDS, TERM_OF, Arrival, Reward, Term, Time, UnknownTerm, in_order


def reward_from_json(content: Mapping[str, Any]) -> Reward:
    """The reward that `to_json` was called of, or that version 0.1 wrote.

    Raises:
        KeyError, TypeError: it is none.
    """
    name, clip = content["name"], content["clip"]
    values = {key: value for key, value in content.items() if key not in ("name", "clip", "terms", Reward.CODES)}
    for key, value in values.items():
        if key not in TERM_OF:
            raise KeyError(key)
        if not (value is None or (isinstance(value, int | float) and not isinstance(value, bool))):
            raise TypeError(f"{key} is {value!r:.40}")
    if not isinstance(name, str) or not isinstance(clip, bool):
        raise TypeError(f"name is {name!r:.40}, clip {clip!r:.40}")
    if set(values) == {"alpha", "beta", "gamma", "terminal", "blocked"} and values["blocked"] is None:
        return _of_format_1(name, values, clip)
    if name == "bump" and set(values) == {"alpha", "beta", "gamma", "terminal", "blocked"}:
        return _of_format_1(name, values, clip)
    terms: dict[type[Term], Term] = {}
    for key, value in values.items():
        if value is not None:
            kind = TERM_OF[key]
            terms[kind] = replace(terms.get(kind, kind()), **{key: value})
    codes = content.get(Reward.CODES, {})  # earlier versions wrote none
    if not isinstance(codes, dict) or not all(isinstance(code, str) for code in codes.values()):
        raise TypeError(f"{Reward.CODES} is {codes!r:.40}")
    others = [
        UnknownTerm(path, tuple(sorted(own.items())), codes.get(path)) for path, own in content.get("terms", {}).items()
    ]
    if Arrival not in terms:
        raise KeyError("terminal")
    return Reward(name, in_order(terms, others), clip)


def _of_format_1(name: str, values: Mapping[str, float | None], clip: bool) -> Reward:
    """A reward whose record held all five values, those of the zones even where they were an ordinary step's."""
    base = REWARDS.get(name, Reward(name, (Time(), Arrival())))
    told = {"alpha", "terminal", "blocked", *base.parameters}
    kept = {key: value for key, value in values.items() if key in told or value != values["alpha"]}
    changed = base.with_changes(clip=clip, **kept)
    return changed if name in REWARDS else replace(changed, name=name)
