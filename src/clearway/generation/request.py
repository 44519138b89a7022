"""What is asked for: a kind of plan, a split, a seed and a number; from them alone follow a name and random numbers."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import get_args

import numpy as np

from clearway.choices import PlanKind, SplitName
from clearway.errors import ClearwayError

GENERATOR_VERSION = 2
"""Raised whenever the same request gives another plan."""

KINDS: tuple[PlanKind, ...] = get_args(PlanKind)
SPLITS: tuple[SplitName, ...] = get_args(SplitName)
ROOM_USES = ("kitchen", "living room", "bedroom", "bathroom")
MAX_NUMBER = 999_999  # six digits in names
MAX_SEED = 2**31 - 1
SIZE_PX = (96, 128)  # height and width of pictures where nothing else is asked for


@dataclass(frozen=True)
class Request:
    """One plan.

    Attributes:
        kind: "room" or "flat".
        split: "train", "validation" or "test".
        seed: 0 to 2^31 - 1.
        number: 0 to 999,999.

    Raises:
        ClearwayError: one of them is none.
    """

    kind: PlanKind
    split: SplitName
    seed: int
    number: int

    def __post_init__(self) -> None:
        """Check all of it."""
        for name, value, choices in (("kind", self.kind, KINDS), ("split", self.split, SPLITS)):
            if value not in choices:
                raise ClearwayError(
                    f"{name} {value!r:.40}: there is none of that name. Use one of {', '.join(choices)}"
                )
        for name, number, most in (("seed", self.seed, MAX_SEED), ("number", self.number, MAX_NUMBER)):
            if not 0 <= number <= most:
                raise ClearwayError(f"{name} {number}: expected 0 to {most}. Give one in that range")

    @classmethod
    def of_seed(cls, seed: int) -> Request:
        """The room that a user chooses by a seed: of validation, the uses in turn."""
        return cls("room", "validation", seed, seed % len(ROOM_USES))

    @property
    def use(self) -> str | None:
        """What a room is used as, the four in turn; None of a flat."""
        return ROOM_USES[self.number % len(ROOM_USES)] if self.kind == "room" else None

    @property
    def name(self) -> str:
        """Of the plan, its scene and its file, for example "room-train-000017-living_room"; a seed above 0 ends it."""
        use = "" if self.use is None else f"-{self.use.replace(' ', '_')}"
        seed = f"-{self.seed}" if self.seed else ""
        return f"{self.kind}-{self.split}-{self.number:06d}{use}{seed}"

    def random(self, attempt: int) -> np.random.Generator:
        """The random numbers of one attempt; no two requests or attempts share them."""
        key = zlib.crc32(f"clearway plan: {self.kind}, {self.split}".encode())
        return np.random.default_rng([key, self.seed, self.number, attempt])


def other_version(notes: Mapping[str, object]) -> str:
    """What the notes of a generated scene say of another version of the generator, in words; empty of this one."""
    version = notes.get("generator")
    if version == GENERATOR_VERSION:
        return ""
    return f"was made by version {version} of the generator, this clearway has version {GENERATOR_VERSION}"
