"""Workers of one training, threads of this process."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import torch.distributed as dist

from clearway.learn.peers import Peers


def by_workers(count: int, work: Callable[[Peers], Any]) -> list[Any]:
    """What `work` gives at each of so many workers, threads here."""
    store, results, errors = dist.HashStore(), [None] * count, []

    def run(rank: int) -> None:
        try:
            results[rank] = work(Peers(dist.ProcessGroupGloo(store, rank, count)))
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=run, args=(rank,), daemon=True) for rank in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(200)
    if errors:
        raise errors[0]
    assert not any(thread.is_alive() for thread in threads)
    return results
