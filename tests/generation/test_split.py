import numpy as np
import pytest

from clearway.generation.plans import draw_plan
from clearway.generation.request import KINDS, SPLITS, Request
from clearway.generation.split import canonical_form, canonical_hash, owner

ELL = np.array([[0, 0], [1, 0], [2, 0], [2, 1]])
TURN = np.array([[0, -1], [1, 0]])
MIRROR = np.array([[-1, 0], [0, 1]])


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("mirrored", [False, True])
def test_equal_plans_have_one_form(turns: int, mirrored: bool) -> None:
    cells = ELL @ np.linalg.matrix_power(TURN, turns) @ (MIRROR if mirrored else np.eye(2, dtype=int))
    moved = cells[::-1] + np.array([7, -3])
    np.testing.assert_array_equal(canonical_form(moved), canonical_form(ELL))
    assert owner(moved) == owner(ELL)


def test_the_form_holds_the_same_cells() -> None:
    np.testing.assert_array_equal(canonical_form(ELL), [[0, 0], [0, 1], [0, 2], [1, 0]])


def test_other_plans_have_another_form() -> None:
    square = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
    tee = np.array([[0, 0], [1, 0], [2, 0], [1, 1]])
    line = np.array([[0, 0], [1, 0], [2, 0], [3, 0]])
    assert len({canonical_hash(cells) for cells in (ELL, square, tee, line)}) == 4


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("split", SPLITS)
def test_plans_belong_to_their_split_and_others_are_drawn_again(kind, split) -> None:
    drawn = [draw_plan(Request(kind, split, 11, number)) for number in range(6)]
    assert {owner(one.plan.cells) for one in drawn} == {split}
    assert sum(one.rejected["split"] for one in drawn) > 0


def test_every_split_owns_a_share() -> None:
    owners = [owner(np.array([[0, 0], [1, 0], [width, depth]])) for width in range(2, 22) for depth in range(1, 11)]
    shares = {split: owners.count(split) / len(owners) for split in SPLITS}
    assert shares["train"] == pytest.approx(0.5, abs=0.1)
    assert shares["test"] == pytest.approx(0.25, abs=0.1) and shares["validation"] == pytest.approx(0.25, abs=0.1)
