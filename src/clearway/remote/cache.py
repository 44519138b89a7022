"""Files from elsewhere on this machine: fetched whole or not at all, within a limit, the least recently used out first.

A file lies in a folder of its own in the cache folder, under `remote`, whose name, its entry, is made of its address,
version and size: the same entry is the same file. What living processes keep stays (`leases`). Where it came from
stands in its record (`records`), by which it is fetched again after it went (`passing`).
"""

from __future__ import annotations

import hashlib
import math
import os
import shutil
import threading
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import chain, islice
from pathlib import Path

from clearway.errors import ClearwayError
from clearway.files import cache_faults_named, locked, part_folder
from clearway.progress import work_progress
from clearway.remote.address import (
    COPIED_NS,
    ENTRY,
    entry_bytes,
    fetched_folder,
    is_fetched,
    is_whole,
    without_secrets,
)
from clearway.remote.leases import lease_of, leased
from clearway.remote.records import record_text, recorded_address, write_records
from clearway.remote.store import RemoteFile, Store
from clearway.remote.together import AT_ONCE, together

LIMIT_VARIABLE = "CLEARWAY_CACHE_GB"
LIMIT_GB = 50.0
AHEAD = 1 / 8  # of the limit, for files that pass, and that as many may have as are fetched together


class CacheWarning(UserWarning):
    """A set does not fit into the cache, or of a copy in it nobody can tell whether it is as its server has it."""


def fetched(addresses: Sequence[str], suffixes: Sequence[str], *, may_pass: bool = False) -> list[Path]:
    """As `fetched_each`, the files of all addresses in one list."""
    return list(chain.from_iterable(fetched_each(addresses, suffixes, may_pass=may_pass)))


def fetched_each(addresses: Sequence[str], suffixes: Sequence[str], *, may_pass: bool = False) -> list[list[Path]]:
    """Files on this machine, of each address: the file that it names, or those of the folder with such endings.

    Args:
        addresses: of files and folders.
        suffixes: of the files that are wanted of folders.
        may_pass: their readers have them come one by one, see `passing`. Where they do not fit together, they are left
            where they are, and a warning says so. Else they stay for as long as this process lives.

    Raises:
        ClearwayError: nothing is there, it cannot be had, or the cache is too small.
    """
    stores = {address: Store(address) for address in addresses}
    listed = together(lambda address, stop: stores[address].listed(address, suffixes, stop), addresses)
    entries = [(stores[address], entry) for address, some in zip(addresses, listed, strict=True) for entry in some]
    found = together(lambda one, stop: one[0].described(one[1], stop), entries)
    files = {file: store for (store, _), file in zip(entries, found, strict=True)}
    folder = fetched_folder()
    places = {file: folder / _entry(file) / file.name for file in files}
    with cache_faults_named(folder):
        _warn_of_unversioned(places)
        may_pass = may_pass and all(file.version and without_secrets(file.address) == file.address for file in files)
        with locked(folder / ".cache"):
            write_records(folder, {_entry(file): record_text(file.address, file.version) for file in files})
            stay = _stay(folder, list(places.values()), may_pass)
        if stay:
            missing = {file: store for file, store in files.items() if not is_whole(places[file])}
            _fetch(missing, folder, show_progress=len(missing) > 1)
        else:
            size_gb, limit_gb = sum(file.size for file in files) / 1e9, _limit() / 1e9
            told = f"{size_gb:,.3g} GB do not fit into a cache of {limit_gb:g} GB, beside what others keep there"
            remedy = f"they are fetched as they are read, more than once. Set {LIMIT_VARIABLE} to more"
            warnings.warn(f"{without_secrets(addresses[0])}: {told}; {remedy}", CacheWarning, stacklevel=2)
    in_order = iter(found)
    return [[places[file] for file in islice(in_order, len(some))] for some in listed]


def _warn_of_unversioned(places: Mapping[RemoteFile, Path]) -> None:
    if unsure := [file for file, place in places.items() if not file.version and is_whole(place)]:
        told = f"{without_secrets(unsure[0].address)}: its server tells no version (ETag, Last-Modified) of its files"
        remedy = f"Remove {places[unsure[0]].parent} to fetch it again"
        others = f" ({len(unsure)} such files)" if len(unsure) > 1 else ""
        problem = "a copy of the same size that was fetched before is taken for the file"
        warnings.warn(f"{told}; {problem}{others}. {remedy}", CacheWarning, stacklevel=3)


def fetch_again(places: Sequence[Path]) -> None:
    """Fetch files again that have gone, one group of them at a time on this machine; they may go again at once.

    Raises:
        ClearwayError: one cannot be had again or is another one now, or the cache is too small for them together.
    """
    folder = fetched_folder()
    with cache_faults_named(folder), locked(folder / ".passing"):
        missing = list(dict.fromkeys(place for place in places if not is_whole(place)))  # others may have fetched some
        files = dict(together(_found_again, missing))
        with _kept_meanwhile(folder, places):
            _fetch(files, folder, show_progress=False)


def groups(places: Iterable[Path]) -> Iterator[list[Path]]:
    """Files in order, by as many as may come together before their turn; those that were never fetched lie here."""
    group: list[Path] = []
    left = most = AHEAD * _limit()
    for place in places:
        size = entry_bytes(place.parent.name) if is_fetched(place) else 0
        left -= size
        if group and (left < 0 or len(group) == AT_ONCE):
            yield group
            group, left = [], most - size
        group.append(place)
    if group:
        yield group


@contextmanager
def _kept_meanwhile(folder: Path, places: Sequence[Path]) -> Iterator[None]:
    """Keep files, with room for them, while the block runs."""
    with locked(folder / ".cache"):
        _keep(folder, places)
    try:
        yield
    finally:
        with locked(folder / ".cache"):
            lease_of(folder).drop([place.parent.name for place in places])


def _stay(folder: Path, places: Sequence[Path], may_pass: bool) -> bool:
    """Keep files for as long as this process lives; not where they may pass and do not fit."""
    kept = leased(folder) | {place.parent.name for place in places}
    if may_pass and sum(map(entry_bytes, kept)) > (1 - AHEAD) * _limit():  # the rest is for those that pass
        return False
    _keep(folder, places)
    return True


def _keep(folder: Path, places: Sequence[Path]) -> None:
    """Add files to the lease, remove what is damaged of them, and make room for all."""
    lease, entries = lease_of(folder), [place.parent.name for place in places]
    lease.add(entries)
    for entry, place in zip(entries, places, strict=True):
        if is_whole(place):
            os.utime(folder / entry)  # used last
        elif os.path.lexists(folder / entry):
            _remove(folder / entry)
    try:
        _make_room(folder)
    except ClearwayError:
        lease.drop(entries)
        raise


def _remove(entry: Path) -> None:
    """Remove an entry, or what lies there in place of one."""
    if entry.is_dir() and not entry.is_symlink():
        shutil.rmtree(entry)
    else:
        entry.unlink()


def _found_again(place: Path, stop: threading.Event) -> tuple[RemoteFile, Store]:
    """A file that was fetched, and has gone since, and where it is.

    Raises:
        ClearwayError: it cannot be had again, or is another one now.
    """
    address = recorded_address(place)
    store = Store(address)
    file = store.file(address, stop)
    if (_entry(file), file.name) != (place.parent.name, place.name):
        raise ClearwayError(f"{address}: has changed since it was first read. Begin again")
    return file, store


def _make_room(folder: Path) -> None:
    """Remove files that nobody keeps until all others and those that are kept fit into the limit.

    Raises:
        ClearwayError: those that are kept do not fit.
    """
    limit, kept = _limit(), leased(folder)
    size = sum(map(entry_bytes, kept))
    if size > limit:
        own = sum(map(entry_bytes, lease_of(folder).uses))
        problem = f"{own / 1e9:,.3g} GB are to be kept here, {(size - own) / 1e9:,.3g} GB by others that run now"
        raise ClearwayError(f"{folder}: {problem}, the limit is {limit / 1e9:g} GB. Set {LIMIT_VARIABLE} to more")
    free = [entry for entry in os.scandir(folder) if entry.name not in kept and ENTRY.fullmatch(entry.name)]
    size += sum(entry_bytes(entry.name) for entry in free)
    if size <= limit:
        return
    with part_folder(folder) as gone:
        for entry in sorted(free, key=lambda entry: entry.stat().st_mtime):
            if size <= limit:
                break
            with suppress(OSError):  # in use, on a system that lets no such file go: the next one
                Path(entry.path).replace(gone / entry.name)
                size -= entry_bytes(entry.name)


def _limit() -> float:
    """Of the cache, bytes."""
    words = os.environ.get(LIMIT_VARIABLE)
    if not words:
        return LIMIT_GB * 1e9
    try:
        limit = float(words)
    except ValueError:
        limit = math.nan
    if not limit > 0:
        raise ClearwayError(f"{LIMIT_VARIABLE}={words:.40}: expected a number of gigabytes. Set it to one, such as 50")
    return limit * 1e9


def _fetch(files: Mapping[RemoteFile, Store], folder: Path, *, show_progress: bool) -> None:
    """Download files; each appears in its place once it is whole."""
    if not files:
        return
    with (
        part_folder(folder) as part,
        work_progress("fetching", len(files), show_progress, unit="files") as show_done,
    ):

        def fetch(file: RemoteFile, stop: threading.Event) -> None:
            new = part / _entry(file)
            new.mkdir()
            files[file].download(file, new / file.name, stop)
            if _entry(files[file].file(file.address, stop)) != new.name:
                problem = "has changed while it was fetched"
                raise ClearwayError(f"{without_secrets(file.address)}: {problem}. Begin again")
            os.utime(new / file.name, ns=(COPIED_NS, COPIED_NS))
            try:
                new.replace(folder / new.name)
            except OSError:
                if not (folder / new.name / file.name).exists():  # else another process or thread was faster
                    raise

        together(fetch, list(files), show_done)


def _entry(file: RemoteFile) -> str:
    """The name of a file's folder: what it is, and its bytes."""
    digest = hashlib.sha256(f"{file.address}\n{file.version}".encode()).hexdigest()
    return f"{digest[:32]}-{file.size}"
