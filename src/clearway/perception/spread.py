"""Encoding in several processes of this machine, or on a Ray cluster: batch by batch, each with one thread.

Features are those of one process with one thread, bit for bit, however many share the work.
"""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager

import numpy as np

from clearway.children import end_with_parent
from clearway.errors import EncoderError
from clearway.perception.encoder import Encoder
from clearway.ray_cluster import connected, result
from clearway.scenes.scene import EncoderRecord, Observations

Loader = Callable[[EncoderRecord], Encoder]
Encode = Callable[[Loader, EncoderRecord, Observations, int], Iterator[np.ndarray]]
"""(loader of encoders, record, pictures, batch) -> features (B, F) float32 of batch after batch, in order."""

_loaded: dict[str, Encoder] = {}  # by identity: a process that encodes many batches loads the network once


def batches(pictures: Observations, batch: int) -> Iterator[tuple[Observations, int, int]]:
    """Batches of pictures (S, ...) of one sensor: where they are, the first and the last, last excluded.

    Pictures in memory are cut to the batch, so that no process is sent more than it needs.
    """
    for first in range(0, pictures.shape[0], batch):
        last = min(first + batch, pictures.shape[0])
        if isinstance(getattr(pictures, "raw", pictures), np.ndarray):
            yield pictures[first:last], 0, last - first
        else:
            yield pictures, first, last


def encode_batch(load: Loader, record: EncoderRecord, pictures: Observations, first: int, last: int) -> np.ndarray:
    """Features (B, F) of the pictures first to last, computed here with one thread."""
    import torch

    torch.set_num_threads(1)
    if record.identity not in _loaded:
        _loaded[record.identity] = load(record)
    return _loaded[record.identity].encode(pictures[first:last])


@contextmanager
def processes(workers: int) -> Iterator[Encode]:
    """Encoding in so many processes, which end on the way out."""
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, context, initializer=_follow_parent)

    def encode(load: Loader, record: EncoderRecord, pictures: Observations, batch: int) -> Iterator[np.ndarray]:
        jobs = [pool.submit(encode_batch, load, record, *part) for part in batches(pictures, batch)]
        try:
            for job in jobs:
                yield job.result()
        except BrokenProcessPool as error:
            remedy = 'Try fewer --workers, which need less memory; a script needs the guard if __name__ == "__main__":'
            raise EncoderError(f"an encoding process died. {remedy}") from error

    try:
        yield encode
    finally:
        pool.shutdown(cancel_futures=True)


@contextmanager
def cluster(address: str, workers: int | None) -> Iterator[Encode]:
    """Encoding on a Ray cluster; files of pictures must have the same path on all nodes.

    Args:
        address: see `ray_cluster.connected`.
        workers: processors under "local"; None: all.
    """
    with connected(address, workers) as ray:
        remote = ray.remote(num_cpus=1)(encode_batch)

        def encode(load: Loader, record: EncoderRecord, pictures: Observations, batch: int) -> Iterator[np.ndarray]:
            kept = ray.put(record)
            for reference in [remote.remote(load, kept, *part) for part in batches(pictures, batch)]:
                yield result(ray, reference, _died)

        yield encode


def _died(reason: str) -> EncoderError:
    return EncoderError(f"an encoding worker or its node died ({reason}). Run the command again")


def _follow_parent() -> None:
    """Leave interrupts to the parent, and end when it does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
