"""Rows rounded up in number: every row still there, scene by scene."""

import pytest
import torch

from clearway.model.padding import Padding


def padded(rows_per_scene: tuple[int, ...], step: int = 4) -> Padding:
    return Padding.to_multiples(step, rows_per_scene, torch.device("cpu"))


def test_the_last_row_of_a_scene_is_repeated() -> None:
    found = padded((3, 0, 4, 5))
    assert found.rows.tolist() == [0, 1, 2, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 11, 11, 11]
    assert found.place.tolist() == [0, 1, 2, 4, 5, 6, 7, 8, 9, 10, 11, 12]
    assert found.rows_per_scene == (4, 0, 4, 8)


@pytest.mark.parametrize("rows_per_scene", [(5, 9, 1), (0, 7, 0), (0, 0), (64,), ()])
@pytest.mark.parametrize("step", [1, 8, 32])
def test_every_row_stands_where_it_is_said_to(rows_per_scene: tuple[int, ...], step: int) -> None:
    found = padded(rows_per_scene, step)
    assert found.rows[found.place].tolist() == list(range(sum(rows_per_scene)))
    assert all(count % step == 0 for count in found.rows_per_scene)
    assert [-(-count // step) for count in rows_per_scene] == [count // step for count in found.rows_per_scene]
    assert len(found.rows) == sum(found.rows_per_scene)
