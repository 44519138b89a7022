"""Files of sets that do not fit into the cache together: they come when they are read, and may go at any time.

Who has opened one reads on, though it goes meanwhile. Any path may be given; files that were never fetched are left as
they are.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from clearway.regular_files import name_of_opened
from clearway.remote.address import is_fetched, is_whole

TRIES = 20  # to open a file that others remove as soon as it has come


@contextmanager
def name_of_present(path: Path) -> Iterator[Path]:
    """As `name_of_opened`; a file that was fetched, and has gone since, comes again.

    Raises:
        OSError: as `name_of_opened`.
        ClearwayError: it cannot be had again or is another one now, or the cache is too small.
    """
    with ExitStack() as opened:
        yield _opened_name(path, opened)


def _opened_name(path: Path, opened: ExitStack) -> Path:
    if not is_fetched(path):
        return opened.enter_context(name_of_opened(path))
    for left in reversed(range(TRIES)):
        bring([path])
        try:
            name = opened.enter_context(name_of_opened(path))
            break
        except FileNotFoundError:
            if not left:
                raise
    with suppress(OSError):  # it has gone again, or may only be read
        os.utime(path.parent)  # used last
    return name


def bring(paths: Sequence[Path]) -> None:
    """Have files come again that were fetched and have gone.

    Raises:
        ClearwayError: as of `name_of_present`.
    """
    wanted = [path for path in paths if is_fetched(path)]
    if not all(map(is_whole, wanted)):
        from clearway.remote.cache import fetch_again

        fetch_again(wanted)


def in_turn(paths: Sequence[Path]) -> Iterator[Path]:
    """Files one after the other; some of those that come next are fetched together.

    Raises:
        ClearwayError: as of `name_of_present`.
    """
    if not any(map(is_fetched, paths)):
        yield from paths
        return
    from clearway.remote.cache import groups

    for group in groups(paths):
        bring(group)
        yield from group
