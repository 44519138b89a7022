import numpy as np
import pytest

from clearway.generation.furnish import SHARES, Furniture, _places, dead_ends, furnished, is_connected
from clearway.generation.outline import NARROWEST, SHAPES, SIZES, Outline, draw_outline, inside_of

USES = tuple(SIZES)


def drawn_map(*lines: str) -> np.ndarray:
    """(X, Z) bool of lines seen from above, "." marked."""
    return (np.array([list(line) for line in lines]) == ".")[::-1].T


def test_dead_ends_on_a_hand_drawn_map() -> None:
    free = drawn_map("..#", ".##", "...")
    assert [tuple(cell) for cell in np.argwhere(dead_ends(free))] == [(1, 2), (2, 0)]
    assert is_connected(free)
    assert not is_connected(drawn_map(".#."))


def test_wall_furniture_stands_with_its_back_to_a_wall() -> None:
    inside = drawn_map(".....", ".....", "..###")
    places = _places(inside, inside, 3, Furniture("counter", (3, 3), 1))
    assert sorted(places) == [
        (0, 0, 1, 3),
        (0, 2, 3, 3),
        (1, 2, 4, 3),
        (2, 1, 5, 2),
        (2, 2, 5, 3),
    ]


def test_free_standing_furniture_has_free_cells_all_round() -> None:
    inside = np.ones((5, 4), bool)
    assert _places(inside, inside, 3, Furniture("table", (3, 3), 2, free_standing=True)) == [(1, 1, 4, 3)]
    assert not _places(inside, inside, 4, Furniture("table", (4, 4), 2, free_standing=True))


@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize("seed", range(4))
def test_furniture_leaves_ways(use: str, seed: int) -> None:
    rng = np.random.default_rng([seed, 1])
    inside = inside_of(draw_outline(use, rng), rng)
    kept = np.zeros_like(inside)
    kept[tuple(np.argwhere(inside)[0])] = True
    free = furnished(inside, use, kept, rng)
    assert is_connected(free)
    assert free[kept].all() and not (free & ~inside).any()
    share = 1 - free.sum() / inside.sum()
    assert 0.1 < share < SHARES[use][1] + 0.2


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
