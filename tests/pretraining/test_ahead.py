"""Things made in other threads: in their order, not too many at once, and with what goes wrong."""

import threading
import time
from collections.abc import Iterator

import pytest

from clearway.pretraining.ahead import AHEAD, made_ahead

THREADS = 4


def test_they_come_in_order_from_several_threads_though_the_first_takes_longest() -> None:
    makers = set()

    def make(number: int) -> int:
        makers.add(threading.get_ident())
        time.sleep(0.05 if number == 0 else 0.002)
        return number**2

    assert list(made_ahead(iter(range(40)), make, THREADS)) == [number**2 for number in range(40)]
    assert len(makers) > 1 and threading.get_ident() not in makers


def test_no_more_are_read_than_are_made_ahead() -> None:
    read = []

    def parts() -> Iterator[int]:
        for number in range(1000):
            read.append(number)
            yield number

    things = made_ahead(parts(), str, THREADS)
    assert next(things) == "0"
    things.close()  # type: ignore[attr-defined]
    assert len(read) <= AHEAD + THREADS


@pytest.mark.parametrize("wrong", ["read", "made"])
def test_what_goes_wrong_is_raised_after_what_was_made_before(wrong: str) -> None:
    def parts() -> Iterator[int]:
        yield from range(3)
        if wrong == "read":
            raise LookupError("gone")
        yield 3

    def make(number: int) -> int:
        if number == 3:
            raise LookupError("gone")
        return number

    things = made_ahead(parts(), make, THREADS)
    assert [next(things) for _ in range(3)] == [0, 1, 2]
    with pytest.raises(LookupError, match="gone"):
        next(things)
