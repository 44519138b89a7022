"""Work in parts, and workers for it: processes of this machine, a Ray cluster, or this process alone."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from clearway.errors import ClearwayError

Tool = TypeVar("Tool")
ATTEMPTS = 3  # for work that goes on where it was, or whose libraries crash now and then, as renderers do
Part = TypeVar("Part")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Work(Generic[Tool, Part, Result]):
    """What is done to many parts. Functions and parts cross process borders: functions stand in modules.

    Attributes:
        set_up: makes, once in every worker, what it works with (a renderer, an encoder).
        do: from that and a part to the part's result.
        died: the error for a part whose worker died, and how it died.
        attempts: how often a part is begun whose worker is killed; on Ray, where nodes come and go, 1 stands for 4.
        environment: variables that workers get before they import anything, where nobody has set them.
        keeps_messages: workers write nothing to standard error; the last line of one that died is part of how it died.
        cores: processors that Ray keeps for a part.
        memory_bytes: memory that Ray keeps for a part.
    """

    set_up: Callable[[], Tool]
    do: Callable[[Tool, Part], Result]
    died: Callable[[Part, str], ClearwayError]
    attempts: int = 1
    environment: Mapping[str, str] = field(default_factory=dict)
    keeps_messages: bool = False
    cores: int = 1
    memory_bytes: int = 0


@dataclass(frozen=True)
class Workers(Generic[Part, Result]):
    """Who does the parts of a work.

    Attributes:
        submit: lets a part be done; gives what will hold its result, or the error that it raised.
        here: no others: `submit` does the part before it comes back.
    """

    submit: Callable[[Part], Future[Result]]
    here: bool = False

    def results(self, parts: Iterable[Part]) -> Iterator[Result]:
        """What becomes of the parts, in their order; the first error of any is raised as soon as it is known."""
        tasks = (self.submit(part) for part in parts)
        yield from (task.result() for task in tasks) if self.here else _in_order(deque(tasks))


def core_count() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def workers_for(
    work: Work[Tool, Part, Result], *, workers: int | None = None, ray: str | None = None
) -> Iterator[Workers[Part, Result]]:
    """Workers that end when the block does, however it does.

    They start when parts wait for them. Their functions must not depend on how many they are.

    Args:
        work: what they do.
        workers: number of processes here; None: this process alone. On Ray as many as find room; under "local" on so
            many times `work.cores` processors, None for all.
        ray: a Ray cluster, see `ray_cluster.connected`; None: none.

    Raises:
        RunError: Ray is not installed, the cluster cannot be reached, or no node has room for a part.
    """
    if ray is not None:
        from clearway.spread.on_ray import on_ray

        with on_ray(work, ray, workers) as submit:
            yield Workers(submit)
    elif workers is not None:
        from clearway.spread.processes import processes

        with processes(work, workers) as submit:
            yield Workers(submit)
    else:
        yield Workers(_in_this_process(work), here=True)


def _in_this_process(work: Work[Tool, Part, Result]) -> Callable[[Part], Future[Result]]:
    tools: list[Tool] = []

    def submit(part: Part) -> Future[Result]:
        if not tools:
            tools.append(work.set_up())
        done: Future[Result] = Future()
        done.set_result(work.do(tools[0], part))
        return done

    return submit


def _in_order(tasks: deque[Future[Result]]) -> Iterator[Result]:
    """The results of tasks; each is let go when it is told, since all together may not fit into memory."""
    pending = set(tasks)
    while tasks:
        task = tasks.popleft()
        while not task.done():
            finished, pending = wait(pending, return_when=FIRST_COMPLETED)
            for other in finished:
                other.result()
            del finished
        pending.discard(task)
        yield task.result()
