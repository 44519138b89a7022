"""NumPy and torch draw the same numbers."""

import numpy as np
import pytest
import torch

from clearway.world.randomness import UNIT, drawn_by, stream_keys, stream_words

SEEDS = np.array(
    [0, 1, 2, 1234567, 2**31, 2**63 - 1, -1, -(2**63), *np.random.default_rng(0).integers(-(2**63), 2**63, 500)]
)


@pytest.mark.parametrize("purpose", [1, 11, 12, 2**40])
def test_keys_are_the_same(purpose: int) -> None:
    keys = stream_keys(SEEDS, purpose)
    assert keys.dtype == np.int64
    assert np.array_equal(keys, stream_keys(torch.from_numpy(SEEDS), purpose).numpy())
    assert len(set(keys.tolist())) == len(set(SEEDS.tolist()))


@pytest.mark.parametrize("drawn", [0, 1, 2**20, 2**62])
def test_words_are_the_same_and_never_out_of_range(drawn: int) -> None:
    keys, count = stream_keys(SEEDS, 12), np.full_like(SEEDS, drawn)
    words = stream_words(keys, count)
    assert words.dtype == np.int64 and (words >= 0).all() and (words < 2**53).all()
    assert np.array_equal(words, stream_words(torch.from_numpy(keys), torch.from_numpy(count)).numpy())
    assert ((words * UNIT >= 0) & (words * UNIT < 1)).all()


@pytest.mark.parametrize("sum_to_one", [True, False])
def test_actions_drawn_are_the_same(sum_to_one: bool) -> None:
    rng = np.random.default_rng(1)
    told = rng.random((5000, 4)) * (rng.random((5000, 4)) < 0.7) + np.array([0.0, 0.0, 0.0, 1e-9])
    told = told / told.sum(1, keepdims=True) if sum_to_one else told
    uniform = rng.random(5000)
    uniform[:3] = 0.0, np.nextafter(1, 0), 0.5
    found = drawn_by(told, uniform)
    assert np.array_equal(found, drawn_by(torch.from_numpy(told), torch.from_numpy(uniform)).numpy())
    assert (told[np.arange(5000), found] > 0).all()


def test_actions_follow_their_bounds() -> None:
    told = np.array([[0.25, 0.25, 0.0, 0.5]]).repeat(6, 0)
    uniform = np.array([0.0, 0.2499, 0.25, 0.4999, 0.5, 0.9999999999])
    for numbers in ((told, uniform), (torch.from_numpy(told), torch.from_numpy(uniform))):
        assert drawn_by(*numbers).tolist() == [0, 0, 1, 1, 3, 3]
