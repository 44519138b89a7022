"""Furniture that hangs loose: what belongs together, and that hanging it loose does not change a picture."""

from __future__ import annotations

import numpy as np
import pytest

from clearway.rooms import build_room
from clearway.rooms.camera import first_person_view
from clearway.rooms.frame import Frame
from clearway.rooms.pieces import FIXED, loose_obstacles, pieces_of_parts
from clearway.rooms.render import render
from clearway.rooms.room import Room
from clearway.rooms.shell import Column, add_walls


@pytest.fixture
def room() -> Room:
    """A table of 80 cm with a pot on it, a stool, a picture on the wall above the table, a skirting board."""
    room = Room("attic", 4.0, 4.0, 2.5, (0.25, 0.25))
    add_walls(room, (Column(1.0, 3.0, 1.2, 4.0),))
    table, stool = Frame(2.0, 0.3), Frame(3.0, 2.0)
    room.box(table, (0, 0, 0.76), (1.0, 0.6, 0.04), "oak")
    room.box(table, (0.45, 0.25, 0), (0.05, 0.05, 0.76), "oak")
    room.cylinder(table, (0.2, 0, 0.8), 0.1, 0.3, "green")  # the pot
    room.cylinder(table, (0.2, 0, 1.1), 0.05, 0.1, "green")  # its lid
    room.block(table, (0, 0, 0.4), (1.0, 0.6, 0.8))
    room.cylinder(stool, (0, 0, 0), 0.15, 0.4, "oak")
    room.post(stool, 0.15, 0.4)
    room.box(room.wall("south", 2.0), (0, 0.02, 1.0), (0.5, 0.02, 0.4), "white")  # lower edge beside the pot
    room.box(room.wall("south", 2.0), (0, 0.008, 0), (4.0, 0.016, 0.09), "white")
    room.box(Frame(0.5, 3.0), (0, 0, 0), (0.3, 0.3, 0.01), "white")  # a mat
    return room


def test_what_stands_on_a_piece_belongs_to_it_and_what_hangs_on_the_wall_does_not(room):
    pieces = pieces_of_parts(loose_obstacles(room.spec), room.parts, (4.0, 4.0))
    assert pieces.tolist() == [0, 0, 0, 0, 1, FIXED, FIXED, FIXED]


def test_walls_columns_and_what_hangs_high_are_not_loose(room):
    room.block(Frame(3.0, 0.2), (0, 0, 1.7), (0.8, 0.4, 0.6))  # a cupboard on the wall
    assert [geom.pos.tolist() for geom in loose_obstacles(room.spec)] == [[2.0, 0.3, 0.4], [3.0, 2.0, 0.2]]


@pytest.mark.slow
def test_a_room_with_loose_furniture_looks_the_same():
    where = first_person_view(np.array([[2.25, 0.75], [4.25, 2.25], [0.75, 2.75]]), np.array([180, 270, 90]))
    fixed, loose = (render(build_room("bathroom", loose=choice).spec.compile(), where) for choice in (False, True))
    difference = np.abs(fixed.astype(int) - loose)
    assert difference.max() <= 8 and difference.mean() < 0.01
