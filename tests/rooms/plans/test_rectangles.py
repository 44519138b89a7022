from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from clearway.rooms.plans.rectangles import cut, rectangles

EXAMPLES = settings(max_examples=100, deadline=None, derandomize=True)


def drawn(*lines: str) -> np.ndarray:
    """The map (X, Z) of lines seen from above, far end first; "#" is marked."""
    return (np.array([list(line) for line in lines]) == "#")[::-1].T


def test_the_largest_box_comes_first() -> None:
    step = drawn(
        "#...",
        "####",
        "####",
    )
    assert rectangles(step, 4) == [(0, 0, 4, 2), (0, 2, 1, 3)]


def test_no_box_is_wider_than_asked() -> None:
    assert rectangles(np.ones((4, 6), bool), 3) == [(0, 0, 3, 6), (3, 0, 4, 6)]


@EXAMPLES
@given(arrays(bool, st.tuples(st.integers(1, 8), st.integers(1, 8))), st.integers(1, 4))
def test_boxes_cover_every_marked_cell_once(marked: np.ndarray, widest: int) -> None:
    covered = np.zeros(marked.shape, int)
    for i0, j0, i1, j1 in rectangles(marked, widest):
        assert 1 <= min(i1 - i0, j1 - j0) <= widest
        covered[i0:i1, j0:j1] += 1
    assert np.array_equal(covered, marked.astype(int))


@pytest.mark.parametrize("box", [(2, 3, 21, 5), (2, 3, 4, 22)])
def test_a_long_box_is_cut_across(box: tuple[int, int, int, int]) -> None:
    pieces = cut(box, 2, 8, np.random.default_rng(0))
    along = 0 if box[2] - box[0] > 2 else 1
    assert [piece[1 - along] for piece in pieces] == [box[1 - along]] * len(pieces)
    assert pieces[0][along] == box[along] and pieces[-1][2 + along] == box[2 + along]
    assert all(one[2 + along] == other[along] for one, other in pairwise(pieces))
    assert all(2 <= piece[2 + along] - piece[along] <= 8 for piece in pieces)


def test_a_short_box_stays() -> None:
    assert cut((0, 0, 3, 8), 2, 8, np.random.default_rng(0)) == [(0, 0, 3, 8)]
