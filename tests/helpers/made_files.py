"""What makes files one by one, with this process in the place of workers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any

from clearway.errors import SceneError
from clearway.spread.workers import Workers


class Made(list[str]):
    """Names of what is made, and of what cannot be."""

    def __init__(self) -> None:
        super().__init__()
        self.failing: set[str] = set()

    def workers_for(self, name_of: Callable[[Any], str], make: Callable[[Any, Any], object]) -> Callable[..., Any]:
        """Stands in for `spread.workers.workers_for`: `make(work, asked)` makes what is asked for, in this process."""

        def make_file(work: Any, asked: Any) -> str:
            name = name_of(asked)
            if name in self.failing:
                raise SceneError(asked, "cannot be written (No space left on device)", "Make room")
            make(work, asked)
            self.append(name)
            return name

        return in_this_process(make_file)


def in_this_process(make: Callable[[Any, Any], object]) -> Callable[..., Any]:
    """Stands in for `spread.workers.workers_for`; what `make(work, asked)` gives here is a worker's result."""

    @contextmanager
    def workers_for(work: Any, *, workers: int | None, ray: str | None = None) -> Iterator[Workers]:
        def submit(asked: Any) -> Future:
            done: Future = Future()
            done.set_result(make(work, asked))
            return done

        yield Workers(submit, here=True)

    return workers_for
