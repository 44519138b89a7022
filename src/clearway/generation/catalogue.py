"""What furniture a room of each use has: what it must have, what it may have, and how much of its floor that takes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Relation = Literal["facing", "before", "beside"]


@dataclass(frozen=True)
class Furniture:
    """A kind of furniture.

    Attributes:
        kind: what it is, one of `floor_plans.FURNITURE`.
        lengths: cells along its back, least and most.
        depth: cells.
        free_standing: it stands away from all walls; else its whole back is at one.
        chance: that a room has it.
        near: another kind and how it stands to that where it can: facing it, before its front, or beside it at the
            same wall.
        all_round: it can be used from any side; else from its front alone.
        once: a room has one at most.
    """

    kind: str
    lengths: tuple[int, int]
    depth: int
    free_standing: bool = False
    chance: float = 1.0
    near: tuple[str, Relation] | None = None
    all_round: bool = False
    once: bool = False


DOUBLE_BED = Furniture("double bed", (3, 4), 4, all_round=True)
SINGLE_BED = Furniture("single bed", (2, 2), 4, all_round=True)
COFFEE_TABLE = Furniture("coffee table", (2, 3), 2, free_standing=True, near=("sofa", "before"), all_round=True)
DINING_TABLE = Furniture("dining table", (3, 4), 2, free_standing=True, all_round=True)
BATH = Furniture("bath", (3, 4), 2)
SHOWER = Furniture("shower", (2, 2), 2)

KEY: dict[str, tuple[tuple[Furniture, ...], ...]] = {
    "bathroom": (
        (BATH, SHOWER),
        (Furniture("toilet", (1, 1), 1),),
        (Furniture("basin", (2, 3), 1), Furniture("basin", (1, 1), 1)),
    ),
    "kitchen": ((Furniture("counter", (4, 7), 1), Furniture("counter", (3, 3), 1)),),
    "bedroom": ((DOUBLE_BED, SINGLE_BED),),
    "living room": (
        (Furniture("sofa", (4, 5), 2), Furniture("sofa", (3, 3), 2)),
        (COFFEE_TABLE, DINING_TABLE, Furniture("table", (2, 3), 2)),
    ),
    "corridor": (),
}
"""What makes a room of its use: one of each group, the first that finds a place; now and then they change places."""

SECOND_CHANCE = 0.3  # that the second of a group is tried before the first

MORE: dict[str, tuple[Furniture, ...]] = {
    "bathroom": (Furniture("shower", (2, 2), 2, chance=0.15), Furniture("cabinet", (1, 2), 1, chance=0.5)),
    "kitchen": (
        Furniture("fridge", (2, 2), 1, near=("counter", "beside"), once=True),
        Furniture("dining table", (2, 4), 2, free_standing=True, chance=0.7, all_round=True),
        Furniture("island", (3, 4), 2, free_standing=True, chance=0.4, once=True),
        Furniture("worktop", (2, 4), 1, chance=0.7),
    ),
    "bedroom": (
        Furniture("nightstand", (1, 1), 1, chance=0.8, near=("double bed", "beside")),
        Furniture("nightstand", (1, 1), 1, chance=0.5, near=("double bed", "beside")),
        Furniture("wardrobe", (3, 4), 1),
        Furniture("desk", (2, 3), 1, chance=0.5, once=True),
        Furniture("chest", (2, 2), 1, chance=0.5),
    ),
    "living room": (
        Furniture("television", (3, 4), 1, near=("sofa", "facing"), once=True),
        Furniture("armchair", (2, 2), 2, chance=0.5),
        Furniture("dining table", (3, 4), 2, free_standing=True, chance=0.6, all_round=True),
        Furniture("bookcase", (2, 4), 1, chance=0.8),
        Furniture("fireplace", (3, 3), 1, chance=0.25, once=True),
    ),
    "corridor": (Furniture("coats", (2, 3), 1, chance=0.5), Furniture("shoe cabinet", (2, 3), 1, chance=0.3)),
}
"""What it has besides, in this order."""

FURTHER: dict[str, tuple[Furniture, ...]] = {
    "bathroom": (Furniture("cabinet", (1, 2), 1),),
    "kitchen": (
        Furniture("sideboard", (2, 4), 1),
        Furniture("pantry", (2, 3), 1),
        Furniture("worktop", (2, 3), 1),
        Furniture("plant", (1, 1), 1),
    ),
    "bedroom": (
        Furniture("bookcase", (2, 3), 1),
        Furniture("chest", (2, 3), 1),
        Furniture("armchair", (2, 2), 2),
        Furniture("plant", (1, 1), 1),
    ),
    "living room": (
        Furniture("bookcase", (2, 4), 1),
        Furniture("sideboard", (3, 4), 1),
        Furniture("sofa", (3, 4), 2),
        Furniture("armchair", (2, 2), 2),
        Furniture("plant", (1, 1), 1),
        Furniture("desk", (2, 3), 1, once=True),
    ),
    "corridor": (),
}
"""What fills it up to its share, drawn again and again."""

SHARES = {
    "bathroom": (0.16, 0.32),
    "kitchen": (0.36, 0.54),
    "bedroom": (0.36, 0.54),
    "living room": (0.30, 0.50),
    "corridor": (0.0, 0.15),
}
"""Of a room's cells that furniture takes, least and most."""

SNUG = {"bathroom": 0.5, "kitchen": 0.25, "bedroom": 0.25, "living room": 0.1, "corridor": 0.5}
"""How often a piece is put where it touches most walls and other pieces: into corners and rows."""
