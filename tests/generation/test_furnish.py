import numpy as np
import pytest

from clearway.generation.catalogue import FURTHER, KEY, MORE, SHARES, Furniture
from clearway.generation.furnish import Place, Zone, dead_ends, furnished, is_connected, places_for
from clearway.generation.outline import NARROWEST, SHAPES, SIZES, Outline, draw_outline, inside_of
from clearway.scenes.floor_plans import FURNITURE

USES = tuple(SIZES)


def drawn_map(*lines: str) -> np.ndarray:
    """(X, Z) bool of lines seen from above, "." marked."""
    return (np.array([list(line) for line in lines]) == ".")[::-1].T


def test_dead_ends_on_a_hand_drawn_map() -> None:
    free = drawn_map("..#", ".##", "...")
    assert [tuple(cell) for cell in np.argwhere(dead_ends(free))] == [(1, 2), (2, 0)]
    assert is_connected(free)
    assert not is_connected(drawn_map(".#."))


def boxes(places) -> list[tuple[int, int, int, int, str]]:
    return sorted((at.x0, at.z0, at.x1, at.z1, at.front) for at in places)


def test_wall_furniture_stands_with_its_back_to_a_wall() -> None:
    inside = drawn_map(".....", ".....", "..###")
    assert boxes(places_for(inside, inside, 3, Furniture("counter", (3, 3), 1))) == [
        (0, 0, 1, 3, "east"),
        (0, 2, 3, 3, "south"),
        (1, 2, 4, 3, "south"),
        (2, 1, 5, 2, "north"),
        (2, 2, 5, 3, "south"),
    ]


def test_a_deep_piece_has_its_back_and_not_its_front_at_the_wall() -> None:
    inside = np.ones((4, 6), bool)
    found = boxes(places_for(inside, inside, 4, Furniture("bed", (4, 4), 3)))
    assert found == [
        (0, 0, 3, 4, "east"),
        (0, 0, 4, 3, "north"),
        (0, 1, 3, 5, "east"),
        (0, 2, 3, 6, "east"),
        (0, 3, 4, 6, "south"),
        (1, 0, 4, 4, "west"),
        (1, 1, 4, 5, "west"),
        (1, 2, 4, 6, "west"),
    ]


def test_free_standing_furniture_has_free_cells_all_round() -> None:
    inside = np.ones((5, 4), bool)
    (place,) = places_for(inside, inside, 3, Furniture("table", (3, 3), 2, free_standing=True))
    assert (place.x0, place.z0, place.x1, place.z1) == (1, 1, 4, 3) and place.front in ("south", "north")
    assert not list(places_for(inside, inside, 4, Furniture("table", (4, 4), 2, free_standing=True)))


def test_where_a_place_lies_beyond_another() -> None:
    sofa = Place(2, 3, 6, 5, "north")
    assert sofa.beyond("north", 2) == Place(2, 5, 6, 7, "north")
    assert sofa.beyond("west") == Place(1, 3, 2, 5, "west")
    assert Place(5, 6, 7, 8, "south").meets(sofa.beyond("north", 2))
    assert not Place(6, 5, 7, 8, "south").meets(sofa.beyond("north", 2))


@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize("seed", range(4))
def test_furniture_leaves_ways(use: str, seed: int) -> None:
    rng = np.random.default_rng([seed, 1])
    inside = inside_of(draw_outline(use, rng), rng)
    kept = np.zeros_like(inside)
    kept[tuple(np.argwhere(inside)[0])] = True
    room = furnished([Zone(use, inside)], kept, rng)
    assert room is not None and is_connected(room.free)
    assert room.free[kept].all() and not (room.free & ~inside).any()
    share = 1 - room.free.sum() / inside.sum()
    assert 0.1 < share < SHARES[use][1] + 0.3
    covered = np.zeros_like(inside, int)
    for piece, place in room.pieces:
        covered[place.cells] += 1
        sides = ("south", "north", "west", "east") if piece.all_round else (place.front,)
        assert any(room.free[cells_in(place.beyond(side))].any() for side in sides), piece.kind
    np.testing.assert_array_equal(covered, (inside & ~room.free).astype(int))


def cells_in(place: Place) -> tuple[slice, slice]:
    """A place as an index of a map that it may reach beyond."""
    return np.s_[max(0, place.x0) : max(0, place.x1), max(0, place.z0) : max(0, place.z1)]


def test_a_room_that_its_key_pieces_do_not_fit_is_none() -> None:
    rng = np.random.default_rng(0)
    assert furnished([Zone("bedroom", np.ones((3, 3), bool))], np.zeros((3, 3), bool), rng) is None
    assert furnished([Zone("bedroom", np.ones((4, 5), bool))], np.zeros((4, 5), bool), rng) is not None


def test_what_a_room_may_have_is_known_to_plans() -> None:
    for use in SHARES:
        pieces = {piece.kind for piece in (*MORE[use], *FURTHER[use], *(one for group in KEY[use] for one in group))}
        assert pieces <= set(FURNITURE)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("seed", range(5))
def test_outlines_are_one_part_of_their_shape(shape: str, seed: int) -> None:
    inside = inside_of(Outline(8, 6, shape), np.random.default_rng(seed))
    assert is_connected(inside)
    cut = {"rectangle": 0, "L": 1, "T": 2, "niche": 2, "breast": 1}[shape]
    corners = 4 - sum(inside[corner] for corner in ((0, 0), (0, -1), (-1, 0), (-1, -1)))
    assert corners <= cut
    assert (inside.sum() == inside.size) == (shape == "rectangle")
    assert inside.any(axis=1).sum() >= NARROWEST
