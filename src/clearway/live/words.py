"""Perturbations by words, as a command line has them: `all`, `geometry light`, `camera-pitch-jitter=2`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

from clearway.errors import ArgumentError
from clearway.live.conditions import MOST, REFERENCE, Perturbations
from clearway.spelling import did_you_mean

GEOMETRY = replace(REFERENCE, light=0.0, pixel_noise=0.0)
"""Where the camera is, and what stands in the room; light and noise can be added to pictures later."""
GROUPS = {"none": Perturbations(), "geometry": GEOMETRY, "all": REFERENCE}


def perturbations_named(words: Sequence[str]) -> Perturbations:
    """The perturbations that some words ask for; a later word changes what an earlier one asked for.

    Args:
        words: a group of `GROUPS`; a perturbation's name, with hyphens or underscores, for its full strength in
            `conditions.REFERENCE`; or NAME=STRENGTH.

    Raises:
        ArgumentError: a word is none of these, or a strength is out of range.
    """
    listed = isinstance(words, Sequence) and not isinstance(words, str)
    if not listed or not all(isinstance(word, str) for word in words):
        raise ArgumentError(f"perturb={words!r:.80}: expected words, such as ('geometry', 'light=0.2'). Give a list")
    found = Perturbations()
    for word in words:
        left, equals, text = word.partition("=")
        name = left.replace("-", "_")
        if name in GROUPS and not equals:
            asked = {field: value for field, value in GROUPS[name].to_json().items() if value or name == "none"}
        elif name in REFERENCE.to_json():
            asked = {name: _strength(name, text) if equals else getattr(REFERENCE, name)}
        else:
            known = [*GROUPS, *(field.name.replace("_", "-") for field in fields(Perturbations))]
            told = f"perturb={word!r:.40}: there is none of that name.{did_you_mean(left, known)}"
            raise ArgumentError(f"{told} Choose among {', '.join(known)}")
        found = replace(found, **asked)
    return found


def _strength(name: str, text: str) -> float | bool:
    """The number after NAME=, or whether it is to be at all. Raises ArgumentError where it is none, or out of range."""
    shown = name.replace("_", "-")
    if name not in MOST:
        if text not in ("0", "1"):
            raise ArgumentError(f"perturb='{shown}={text:.40}': it is there or not. Write {shown}, or {shown}=0")
        return text == "1"
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value <= MOST[name]:
        raise ArgumentError(f"perturb='{shown}={text:.40}': expected a number from 0 to {MOST[name]:g}. Correct it")
    return value
