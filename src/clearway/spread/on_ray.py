"""Parts done on a Ray cluster, wherever there is room; a part whose worker or node dies is begun again elsewhere."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError, Future, InvalidStateError
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any
from uuid import uuid4

from clearway.errors import ClearwayError, RunError
from clearway.ray_cluster import connected
from clearway.spread.messages import to_message
from clearway.spread.worker import done, packed
from clearway.spread.workers import Part, Result, Tool, Work

GRACE_S = 60.0  # for parts under way to end when they are told to: training saves a checkpoint first
ATTEMPTS_ON_RAY = 4  # where the work does not say
LOOKS_EVERY_S = 2.0
LOST_S = 60.0  # with no node that has room, until the work is given up; Ray would wait for ever


@contextmanager
def on_ray(
    work: Work[Tool, Part, Result], address: str, workers: int | None
) -> Iterator[Callable[[Part], Future[Result]]]:
    """What lets a part be done on a cluster; parts that are not done when the block ends are ended: see `workers_for`.

    Files that parts name must have the same path on all nodes.
    """
    with connected(address, None if workers is None else workers * work.cores) as ray:
        _check_room(ray, work)
        message, key = ray.put(packed(work.set_up, work.do)), uuid4().hex
        attempts = work.attempts if work.attempts > 1 else ATTEMPTS_ON_RAY
        options = {"num_cpus": work.cores, "memory": work.memory_bytes or None, "max_retries": attempts - 1}
        remote = ray.remote(**options)(_done_on_node)
        under_way: dict[Any, Future[Result]] = {}
        over = threading.Event()
        threading.Thread(target=_give_up_without_room, args=(ray, work, under_way, over), daemon=True).start()

        def submit(part: Part) -> Future[Result]:
            reference = remote.remote(dict(work.environment), key, [message], to_message(part))
            told: Future[Result] = Future()
            under_way[reference] = told

            def tell(answer: Future[Result]) -> None:
                under_way.pop(reference, None)
                with suppress(InvalidStateError):  # it was given up before
                    _pass_on(ray, answer, told, partial(work.died, part))

            reference.future().add_done_callback(tell)
            return told

        try:
            yield submit
        finally:
            over.set()
            left = list(under_way)
            for reference in left:
                ray.cancel(reference, force=False)
            if left:
                ray.wait(left, num_returns=len(left), timeout=GRACE_S)


def _done_on_node(environment: Mapping[str, str], key: str, message: list[Any], part: bytes) -> Any:
    """The result of a part, in a process of a node; the work's message is fetched only to set up."""
    import ray

    for name, value in environment.items():
        os.environ.setdefault(name, value)
    return done(key, lambda: ray.get(message[0]), part)


def _pass_on(ray: Any, answer: Future[Result], told: Future[Result], died: Callable[[str], ClearwayError]) -> None:
    """Tell what Ray answered, with our own errors instead of Ray's."""
    error = answer.exception()
    if error is None:
        told.set_result(answer.result())
    elif isinstance(error, ray.exceptions.TaskCancelledError):
        told.set_exception(CancelledError())
    elif isinstance(error, ray.exceptions.RayTaskError):
        told.set_exception(error.cause if isinstance(error.cause, ClearwayError) else error)
    elif isinstance(error, ray.exceptions.RayError):
        told.set_exception(died(f"died ({str(error).strip().splitlines()[0]})"))
    else:
        told.set_exception(error)


def _give_up_without_room(
    ray: Any, work: Work[Tool, Part, Result], under_way: Mapping[Any, Future[Result]], over: threading.Event
) -> None:
    """End what is under way once no node has had room for a part for a while, as when the last one was lost."""
    had_room = time.monotonic()
    while not over.wait(LOOKS_EVERY_S):
        try:
            _check_room(ray, work)
            had_room = time.monotonic()
        except (RunError, ray.exceptions.RayError) as fault:
            if time.monotonic() - had_room < LOST_S:
                continue
            for told in list(under_way.values()):
                with suppress(InvalidStateError):
                    told.set_exception(RunError(f"after {LOST_S:g} s: {str(fault).strip().splitlines()[0]}"))


def _check_room(ray: Any, work: Work) -> None:
    """Refuse what Ray would wait for without a word.

    Raises:
        RunError: no node has the processors and the memory for a part.
    """
    nodes = [node["Resources"] for node in ray.nodes() if node["Alive"]]
    if not any(node.get("CPU", 0) >= work.cores and node.get("memory", 0) >= work.memory_bytes for node in nodes):
        found = "; ".join(f"{node.get('CPU', 0):g} and {node.get('memory', 0) / 1e9:.1f} GB" for node in nodes)
        raise RunError(
            f"no node of the Ray cluster has the {work.cores} processors and {work.memory_bytes / 1e9:g} GB of memory "
            f"that a worker takes (there are {found or 'none'}). Give fewer --threads, or add a larger node"
        )
