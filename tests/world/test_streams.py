import numpy as np
import pytest
import torch

from clearway.world.streams import AHEAD, Streams, stream_keys

WORD = 2**64


def mixed(x: int) -> int:
    """SplitMix64's output function in Python's own integers."""
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9 % WORD
    x = (x ^ (x >> 27)) * 0x94D049BB133111EB % WORD
    return x ^ (x >> 31)


def split_mix(key: int, position: int) -> int:
    """Number `position` (from 1) of the generator seeded with `key`."""
    return mixed((key + position * 0x9E3779B97F4A7C15) % WORD)


def key_of(seed: int, purpose: int) -> int:
    return split_mix(split_mix(seed, 1), purpose)


def unsigned(words: torch.Tensor) -> list[int]:
    return [word % WORD for word in words.tolist()]


def test_the_published_numbers_of_splitmix64() -> None:
    streams = Streams(torch.tensor([0]), purpose=1)
    streams.keys = torch.tensor([1234567])
    published = [6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431]
    assert [split_mix(1234567, n) for n in (1, 2, 3, 4)] == published
    assert [streams.uniform().item() for _ in published] == [(word >> 11) / 2**53 for word in published]


@pytest.mark.parametrize("purpose", [1, 2, 3])
def test_keys_and_numbers_equal_those_of_plain_integers(purpose: int) -> None:
    seeds = [0, 1, 7, 2**31, 2**63 - 1, -1, -(2**63)]
    assert unsigned(stream_keys(torch.tensor(seeds), purpose)) == [key_of(seed, purpose) for seed in seeds]
    streams = Streams(torch.tensor(seeds), purpose)
    for position in range(1, 20):
        expected = [(split_mix(key_of(seed, purpose), position) >> 11) / 2**53 for seed in seeds]
        assert streams.uniform().tolist() == expected


def test_a_stream_does_not_depend_on_its_batch() -> None:
    together, alone = Streams(torch.arange(50), 1), Streams(torch.tensor([17]), 1)
    for _ in range(10):
        assert together.uniform()[17] == alone.uniform()[0]


def test_uniform_and_at_walk_the_same_stream() -> None:
    batch, picked = Streams(torch.arange(6), 1), Streams(torch.arange(6), 1)
    index = torch.tensor([4, 1])
    first, second = batch.uniform(), batch.uniform()
    assert torch.equal(picked.at(index), first[index])
    assert torch.equal(picked.at(index), second[index])
    assert picked.drawn.tolist() == [0, 2, 0, 0, 2, 0]


def test_unused_streams_do_not_advance() -> None:
    streams, reference = Streams(torch.arange(3), 1), Streams(torch.arange(3), 1)
    streams.uniform(torch.tensor([True, False, True]))
    first, second = reference.uniform(), reference.uniform()
    assert streams.uniform().tolist() == [second[0], first[1], second[2]]


def test_streams_go_on_from_where_others_stood() -> None:
    streams, copy = Streams(torch.arange(3), 1), Streams(torch.arange(3), 1)
    for _ in range(5):
        streams.uniform(torch.tensor([True, False, True]))
    copy.uniform()
    copy.seek(streams.drawn.clone())
    for _ in range(2 * AHEAD):
        assert torch.equal(copy.uniform(), streams.uniform())


def test_drawing_for_some_and_for_all_may_take_turns() -> None:
    together, alone = Streams(torch.arange(3), 1), [Streams(torch.tensor([seed]), 1) for seed in range(3)]
    for turn in range(2 * AHEAD):
        index = torch.tensor([turn % 3, (turn + 1) % 3])
        assert together.at(index).tolist() == [alone[number].uniform().item() for number in index.tolist()]
        assert together.uniform().tolist() == [stream.uniform().item() for stream in alone]


def test_reseeding_begins_some_streams_anew() -> None:
    streams = Streams(torch.arange(4), 1)
    streams.uniform()
    streams.reseed(torch.tensor([9]), torch.tensor([2]))
    begun, going_on = Streams(torch.tensor([9]), 1), Streams(torch.arange(4), 1)
    going_on.uniform()
    expected = going_on.uniform()
    expected[2] = begun.uniform()[0]
    assert torch.equal(streams.uniform(), expected)


def test_numbers_are_uniform_along_a_stream_and_across_seeds() -> None:
    along, across = Streams(torch.tensor([3]), 1), Streams(torch.arange(50_000), 1)
    for numbers in (torch.cat([along.uniform() for _ in range(5_000)]), across.uniform()):
        assert numbers.min() >= 0.0 and numbers.max() < 1.0
        counts = np.bincount((numbers * 20).long().numpy(), minlength=20)
        expected = len(numbers) / 20
        assert ((counts - expected) ** 2 / expected).sum() < 50.0  # chi-square, 19 degrees: 50 has p = 1e-4


def test_purposes_and_neighbouring_seeds_are_unrelated() -> None:
    starts, targets = Streams(torch.arange(20_000), 1).uniform(), Streams(torch.arange(20_000), 2).uniform()
    for left, right in ((starts, targets), (starts[:-1], starts[1:])):
        correlation = np.corrcoef(left.numpy(), right.numpy())[0, 1]
        assert abs(correlation) < 0.03  # four standard errors
