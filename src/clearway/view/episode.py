"""`Episode`: all that an episode in the viewer is made of, as a query string that a link can carry.

    scene=bathroom&start=31&target=48&selection=sampled&seed=7&drive=1&walk=FRFF&walk=FFRL&walk=FLF

A walk is what was done so far, a letter an action: agent after agent, then the user. Whoever opens it sees the same
steps again, even where the agents have learnt on or rounding is different; after them, agents choose as ever.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args
from urllib.parse import parse_qsl, urlencode

from clearway.agents.selection import ActionSelection
from clearway.errors import ClearwayError
from clearway.learn.seeds import SEED_LIMIT

LETTERS = "FRLB"
"""Of the actions, in the order of `scenes.actions.Action`: forward, right, left, backward."""
MOST_STEPS = 1000
"""Longest walk of an episode in the viewer."""
MOST_WALKERS = 3
FIELDS = ("scene", "start", "target", "selection", "seed", "drive", "walk")
LONGEST_QUERY = 8000  # characters


@dataclass(frozen=True)
class Episode:
    """What is asked for, or what an episode turned out to be.

    Attributes:
        scene: name, or None for the first.
        start: state in the scene's numbering, or None for one drawn by the seed.
        target: state, or None for the scene's first target.
        selection: how agents choose their actions.
        seed: of the start, if it is drawn, and of sampled actions.
        drive: the user walks too.
        walks: actions done so far, in `LETTERS`, one walker after the other.
    """

    scene: str | None = None
    start: int | None = None
    target: int | None = None
    selection: ActionSelection = "sampled"
    seed: int = 0
    drive: bool = False
    walks: tuple[str, ...] = ()

    def query(self) -> str:
        """The query string; `read_episode` reads it."""
        fields: list[tuple[str, object]] = []
        for name in ("scene", "start", "target", "selection", "seed"):
            value = getattr(self, name)
            fields += [(name, value)] if value is not None else []
        fields += [("drive", 1)] if self.drive else []
        fields += [("walk", walk) for walk in self.walks]
        return urlencode(fields)


def read_episode(text: str) -> Episode:
    """An episode from its query string, or from a whole link that ends in one.

    Raises:
        ClearwayError: a part of it is unknown, given twice, or not what it should be.
    """
    query = text.rpartition("#")[2]
    if len(query) > LONGEST_QUERY:
        raise ClearwayError(
            f"an episode's link of {len(query)} characters, at most {LONGEST_QUERY} are read. Shorten it"
        )
    found: dict[str, list[str]] = {name: [] for name in FIELDS}
    for name, value in parse_qsl(query, keep_blank_values=True):
        if name not in found:
            raise _refused(name, value, f"one of {', '.join(FIELDS)}")
        found[name].append(value)
    for name, values in found.items():
        if len(values) > (MOST_WALKERS if name == "walk" else 1):
            raise _refused(name, values[-1], "it fewer times")
    selections = get_args(ActionSelection)
    selection = found["selection"][0] if found["selection"] else "sampled"
    if selection not in selections:
        raise _refused("selection", selection, f"one of {', '.join(selections)}")
    if found["drive"] not in ([], ["0"], ["1"]):
        raise _refused("drive", found["drive"][0], "0 or 1")
    for walk in found["walk"]:
        if len(walk) > MOST_STEPS or not set(walk) <= set(LETTERS):
            raise _refused("walk", walk[:20], f"at most {MOST_STEPS} of the letters {LETTERS}")
    return Episode(
        scene=found["scene"][0] if found["scene"] else None,
        start=_number("start", found["start"]),
        target=_number("target", found["target"]),
        selection=selection,  # type: ignore[arg-type]
        seed=_number("seed", found["seed"]) or 0,
        drive=found["drive"] == ["1"],
        walks=tuple(found["walk"]),
    )


def letters(actions: Sequence[int]) -> str:
    """A walk's actions as letters."""
    return "".join(LETTERS[action] for action in actions)


def actions_of(walk: str) -> list[int]:
    """A walk's letters as actions."""
    return [LETTERS.index(letter) for letter in walk]


def _number(name: str, values: list[str]) -> int | None:
    if not values:
        return None
    if not (values[0].isascii() and values[0].isdigit() and len(values[0]) <= 10 and int(values[0]) < SEED_LIMIT):
        raise _refused(name, values[0], "a whole number from 0")
    return int(values[0])


def _refused(name: str, value: str, expected: str) -> ClearwayError:
    return ClearwayError(f"an episode's link says {name}={value}, expected {expected}. Copy the whole link again")
