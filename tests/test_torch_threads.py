"""Torch uses as many threads as asked for, and afterwards as many as before."""

import pytest
import torch

from clearway.torch_threads import torch_threads


@pytest.fixture(autouse=True)
def three_threads():
    before = torch.get_num_threads()
    torch.set_num_threads(3)
    yield
    torch.set_num_threads(before)


@pytest.mark.parametrize(("count", "meanwhile"), [(1, 1), (2, 2), (None, 3)])
def test_threads_are_set_for_a_while(count: int | None, meanwhile: int) -> None:
    with torch_threads(count):
        assert torch.get_num_threads() == meanwhile
    assert torch.get_num_threads() == 3


def test_threads_are_set_back_after_an_error() -> None:
    with pytest.raises(ZeroDivisionError), torch_threads(1):
        raise ZeroDivisionError
    assert torch.get_num_threads() == 3
