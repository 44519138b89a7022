"""Work in this process alone."""

from functools import partial
from pathlib import Path

import pytest

from clearway.errors import SceneError
from clearway.spread.workers import Work, workers_for
from helpers.spread_parts import died, fail, no_tool, noted, square


def test_this_process_does_a_part_when_it_is_asked_for(tmp_path: Path) -> None:
    asked: list[int] = []

    def numbers():
        for number in (2, 3):
            asked.append(number)
            yield number

    with workers_for(Work(partial(noted, tmp_path), square, died)) as crew:
        results = crew.results(numbers())
        assert not list(tmp_path.glob("set-up-*"))
        assert (next(results), asked) == (4, [2])
        assert (next(results), asked) == (9, [2, 3])
    assert len(list(tmp_path.glob("set-up-*"))) == 1


def test_an_error_is_what_the_part_raises() -> None:
    with workers_for(Work(no_tool, fail, died)) as crew, pytest.raises(SceneError):
        list(crew.results(["scene"]))
