"""A function of very many things: the same by processes as by this one."""

import os
import warnings
from collections.abc import Iterator

import pytest

from clearway.errors import ClearwayError
from clearway.spread import many, workers


def halved(number: int) -> tuple[int, int]:
    if number == 13:
        warnings.warn("13 is odd", stacklevel=1)
    if number == 99:
        raise ClearwayError("99 is too large")
    return number // 2, os.getpid()


@pytest.fixture
def processes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(many, "MANY", 10)
    monkeypatch.setattr(many, "AT_ONCE", 4)
    monkeypatch.setattr(workers.os, "sched_getaffinity", lambda pid: {0, 1}, raising=False)


@pytest.mark.usefixtures("processes")
def test_processes_give_results_warnings_and_errors_as_this_one_does() -> None:
    with pytest.warns(UserWarning, match="13 is odd"):
        found = list(many.of_each(halved, range(30)))
    assert [half for half, _ in found] == [number // 2 for number in range(30)]
    assert os.getpid() not in {pid for _, pid in found}
    with pytest.raises(ClearwayError, match="99 is too large"):
        list(many.of_each(halved, range(90, 110)))


def fetched(numbers: range) -> Iterator[int]:
    warnings.warn(f"next are {list(numbers)}", stacklevel=1)
    yield from numbers


@pytest.mark.usefixtures("processes")
def test_processes_are_told_what_they_do_next() -> None:
    with pytest.warns(UserWarning) as told:
        list(many.of_each(halved, range(14, 24), fetched))
    assert [str(one.message) for one in told] == [
        f"next are {part}" for part in ([*range(14, 18)], [*range(18, 22)], [22, 23])
    ]


def test_few_things_start_no_process() -> None:
    assert {pid for _, pid in many.of_each(halved, range(9))} == {os.getpid()}
