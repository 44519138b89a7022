"""Files of sets that do not fit into the cache together: they come when they are read, and may go afterwards.

Any path may be given; those of files that were never fetched are left as they are.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from clearway.remote.address import is_fetched


@contextmanager
def at_hand(path: Path) -> Iterator[None]:
    """Have a file on this machine while the block runs.

    Raises:
        ClearwayError: it cannot be had again or is another one now, or the cache is too small.
    """
    if not is_fetched(path):
        yield
        return
    from clearway.remote.cache import held

    with held([path]):
        yield


def in_turn(paths: Sequence[Path]) -> Iterator[Path]:
    """Files one after the other, each at hand while its turn lasts; some of those that come next are fetched with it.

    Raises:
        ClearwayError: as of `at_hand`.
    """
    if not all(map(is_fetched, paths)):
        yield from paths
        return
    from clearway.remote.cache import groups, held

    for group in groups(paths):
        with held(group):
            yield from group
