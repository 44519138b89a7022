"""The same function of very many things, by as many processes as there are cores, where that is worth their start."""

from __future__ import annotations

import gc
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeAlias, TypeVar

from clearway.errors import ClearwayError
from clearway.spread.workers import Work, core_count, workers_for

MANY = 500  # things from which on processes are started
AT_ONCE = 50  # things in a part

Thing = TypeVar("Thing")
Result = TypeVar("Result")
_Ahead: TypeAlias = Callable[[Sequence[Any]], Iterable[Any]] | None
_Part: TypeAlias = tuple[Callable[[Any], Any], _Ahead, Sequence[Any]]
_Done: TypeAlias = tuple[list[Any], list[tuple[str, type[Warning]]]]  # results, and what was warned of


def of_each(
    function: Callable[[Thing], Result],
    things: Sequence[Thing],
    ahead: Callable[[Sequence[Thing]], Iterable[Thing]] | None = None,
) -> Iterator[Result]:
    """What a function makes of each thing, in order; what it warns of is warned of here.

    Args:
        function: stands in a module.
        things: the things.
        ahead: gives things in their order, and has those come together that are next; stands in a module.

    Raises:
        ClearwayError: what the function raised, or a process died.
    """
    cores = core_count()
    if len(things) < MANY or cores == 1:
        yield from map(function, things if ahead is None else ahead(things))
        return
    parts = [(function, ahead, things[first : first + AT_ONCE]) for first in range(0, len(things), AT_ONCE)]
    environment = {"OMP_NUM_THREADS": "1"}
    work: Work[None, _Part, _Done] = Work(_ready, _done, _died, environment=environment)
    with workers_for(work, workers=cores) as crew:
        for results, told in crew.results(parts):
            for message, kind in told:
                warnings.warn(message, kind, stacklevel=2)
            yield from results


def _ready() -> None:
    """Keep what was imported from being searched for garbage again and again."""
    gc.freeze()


def _done(_: None, part: _Part) -> _Done:
    """The results of a part, and what was warned of."""
    function, ahead, things = part
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        results = [function(thing) for thing in (things if ahead is None else ahead(things))]
    return results, [(str(one.message), one.category) for one in caught]


def _died(part: _Part, how: str) -> ClearwayError:
    return ClearwayError(f"a process that was to look at {len(part[2])} things {how}. Look for what ends it")
