import numpy as np
import pytest

from clearway.rooms.frame import Frame
from clearway.rooms.furniture import openings
from clearway.rooms.groups import CEILING_GROUP, SHELL_NAME
from clearway.rooms.room import Room


def test_a_doorway_stops_light_and_bodies_above_and_bodies_at_its_jambs() -> None:
    room = Room("hall", 4.0, 4.0, 2.6, (0.5, 0.5))
    openings.doorway(room, Frame(2.0, 2.0, 90.0), 0.7, 0.3, 2.05, 0.04)  # one walks along x
    (shade,) = (part for part in room.parts if not part.material)
    assert shade.centre_m == pytest.approx([2.0, 2.0, (2.09 + 2.6) / 2]) and shade.casts_shadow
    assert np.abs(shade.rotation @ shade.half_extents_m) == pytest.approx([0.15, 0.35, 0.255])
    assert all(geom.name.startswith(SHELL_NAME) for geom in room.spec.geoms)
    places = sorted([round(float(number), 6) for number in geom.pos] for geom in room.spec.geoms)
    assert places == [[2.0, 1.67, 1.025], [2.0, 2.0, 2.325], [2.0, 2.33, 1.025]]


def test_what_hides_the_way_from_above_is_of_the_ceiling() -> None:
    room = Room("hall", 4.0, 4.0, 2.6, (0.5, 0.5))
    openings.doorway(room, Frame(2.0, 2.0), 0.7, 0.3, 2.05, 0.04)
    over = [part for part in room.parts if part.material and abs(part.centre_m[0] - 2.0) < 0.2]
    assert len(over) == 3 and {part.group for part in over} == {CEILING_GROUP}


def test_two_doorways_have_names_of_their_own() -> None:
    room = Room("hall", 4.0, 4.0, 2.6, (0.5, 0.5), looks=False)
    for x_m in (1.0, 3.0):
        openings.doorway(room, Frame(x_m, 2.0), 0.7, 0.3, 2.05, 0.04)
    assert len({geom.name for geom in room.spec.geoms}) == len(room.spec.geoms) == 6 and not room.parts
