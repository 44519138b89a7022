"""Small furniture that fills one cell of the grid; the seed chooses which piece."""

from __future__ import annotations

from clearway.rooms.frame import Frame
from clearway.rooms.furniture import decor, lamps, seating
from clearway.rooms.room import Room

PIECES = (decor.plant, lamps.floor_lamp, decor.basket, seating.pouffe, seating.stool)


def any_small_piece(room: Room, at: Frame) -> None:
    """One of PIECES; on the middle of a cell, each blocks that cell and no other."""
    piece = PIECES[int(room.layout_rng.integers(len(PIECES)))]
    piece(room, at)
