"""Files from elsewhere on this machine: fetched whole or not at all, within a limit, the least recently used out first.

A file lies in a folder of its own in the cache folder, under `remote`, whose name, its entry, is made of its address,
version and size: the same entry is the same file. What living processes use stays (`leases`). Where it came from stands
in its record, by which it is fetched again after it went (`passing`).
"""

from __future__ import annotations

import hashlib
import math
import os
import shutil
import time
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from clearway.errors import ClearwayError
from clearway.files import CACHE_VARIABLE, json_text, locked, part_folder, read_json
from clearway.progress import picture_progress
from clearway.remote.address import MAX_RECORD_BYTES, RECORDS, fetched_folder, without_query
from clearway.remote.leases import Lease, lease_of, leased
from clearway.remote.store import RemoteFile, Store

LIMIT_VARIABLE = "CLEARWAY_CACHE_GB"
LIMIT_GB = 50.0
AT_ONCE = 16  # files that are fetched at a time
WAIT_S, PAUSE_S = 60.0, 0.05  # for other readers to give back what they hold
AHEAD = 1 / 8  # of the limit, that files may have which are fetched before their turn


class CacheWarning(UserWarning):
    """A set does not fit into the cache."""


def fetched(addresses: Sequence[str], suffixes: Sequence[str], *, may_pass: bool = False) -> list[Path]:
    """Files on this machine: those that addresses name, folders by the files in them with such endings, in order.

    Args:
        addresses: of files and folders.
        suffixes: of the files that are wanted of folders.
        may_pass: their readers have them come one by one, see `passing`. Where they do not fit together, they are left
            where they are, and a warning says so. Else they stay for as long as this process lives.

    Raises:
        ClearwayError: nothing is there, it cannot be had, or the cache is too small.
    """
    stores = {address: Store(address) for address in addresses}
    with ThreadPoolExecutor(AT_ONCE) as asking:
        found = list(asking.map(lambda address: stores[address].files(address, suffixes), addresses))
    files = {file: stores[address] for address, some in zip(addresses, found, strict=True) for file in some}
    folder = fetched_folder()
    places = {file: folder / _entry(file) / file.name for file in files}
    with _faults_named(folder):
        _write_records(folder, files)
        if may_pass and all(without_query(file.address) == file.address for file in files) and not _fit(folder, files):
            size_gb, limit_gb = sum(file.size for file in files) / 1e9, _limit_bytes() / 1e9
            told = f"{size_gb:,.3g} GB do not fit into the cache of {limit_gb:g} GB"
            remedy = f"they are fetched as they are read, more than once. Set {LIMIT_VARIABLE} to more"
            warnings.warn(f"{addresses[0]}: {told}; {remedy}", CacheWarning, stacklevel=2)
        else:
            _hold(folder, list(places.values()))
            missing = {file: store for file, store in files.items() if not places[file].exists()}
            _fetch(missing, folder, show_progress=len(missing) > 1)
    return [places[file] for some in found for file in some]


@contextmanager
def held(places: Sequence[Path]) -> Iterator[None]:
    """Have files that were fetched on this machine while the block runs; those that have gone come again.

    Where others hold so much that there is no room for them, they have `WAIT_S` to give some back.

    Raises:
        ClearwayError: one cannot be had again or is another one now, or the cache is too small for them together.
    """
    folder = fetched_folder()
    with _faults_named(folder):
        waits_until = time.monotonic() + WAIT_S
        while not lease_of(folder).hold_again([place.parent.name for place in places]):
            try:
                _hold(folder, places)
                break
            except ClearwayError:
                if time.monotonic() > waits_until or sum(_size(place.parent.name) for place in places) > _limit_bytes():
                    raise
                time.sleep(PAUSE_S)
    try:
        with _faults_named(folder):
            missing = dict.fromkeys(place for place in places if not place.exists())
            _fetch(dict(_found_again(folder, place) for place in missing), folder, show_progress=False)
        yield
    finally:
        lease_of(folder).give_back([place.parent.name for place in places])


def groups(places: Iterable[Path]) -> Iterator[list[Path]]:
    """Files that were fetched, in order, by as many as may be held together before their turn."""
    group: list[Path] = []
    left = most = AHEAD * _limit_bytes()
    for place in places:
        left -= _size(place.parent.name)
        if group and (left < 0 or len(group) == AT_ONCE):
            yield group
            group, left = [], most - _size(place.parent.name)
        group.append(place)
    if group:
        yield group


@contextmanager
def _faults_named(folder: Path) -> Iterator[None]:
    """Turn what goes wrong with the cache folder into one line."""
    try:
        yield
    except OSError as fault:
        remedy = f"Make room, or set {CACHE_VARIABLE} to another folder"
        raise ClearwayError(f"{folder}: cannot keep what is fetched ({fault.strerror or fault}). {remedy}") from fault


def _fit(folder: Path, files: Iterable[RemoteFile]) -> bool:
    """Whether files fit into the limit together with all that living processes use."""
    with locked(folder / ".cache"):
        return sum(map(_size, leased(folder) | {_entry(file) for file in files})) <= _limit_bytes()


def _hold(folder: Path, places: Sequence[Path]) -> None:
    """Lease entries, of which those that lie there now stay, and make room for the others."""
    lease = lease_of(folder)
    entries = [place.parent.name for place in places]
    with locked(folder / ".cache"):
        lease.hold(entries)
        for place in places:
            if place.exists() and place.stat().st_size != _size(place.parent.name):  # damaged since
                shutil.rmtree(place.parent)
            elif place.exists():
                os.utime(place.parent)
        try:
            _make_room(folder, lease)
        except ClearwayError:
            lease.give_back(entries)
            raise


def _write_records(folder: Path, files: Iterable[RemoteFile]) -> None:
    """Write down where files come from, without the signature of a signed address, which is nobody else's."""
    records = folder / RECORDS
    records.mkdir(parents=True, exist_ok=True)
    known = {entry.name for entry in os.scandir(records)}
    for file in files:
        if (name := _entry(file)) not in known:
            part = records / f".{name}-{os.getpid()}"
            part.write_text(json_text({"address": without_query(file.address), "version": file.version}))
            part.replace(records / name)


def _found_again(folder: Path, place: Path) -> tuple[RemoteFile, Store]:
    """A file that was fetched, and has gone since, and where it is.

    Raises:
        ClearwayError: it cannot be had again, or is another one now.
    """
    entry = place.parent.name
    try:
        address = str(read_json(folder / RECORDS / entry, MAX_RECORD_BYTES)["address"])
    except (OSError, ValueError, KeyError, TypeError) as fault:
        problem = "has gone, and its record, too"
        raise ClearwayError(f"{place}: {problem}. Begin again with the address that it came from") from fault
    store = Store(address)
    file = store.file(address)
    if _entry(file) != entry:
        raise ClearwayError(f"{address}: has changed since it was first read. Begin again")
    return file, store


def _make_room(folder: Path, own: Lease) -> None:
    """Remove files that nobody has leased until all others and those that are leased fit into the limit.

    Raises:
        ClearwayError: those that are leased do not fit.
    """
    limit = _limit_bytes()
    used = leased(folder)
    size = sum(map(_size, used))
    if size > limit:
        wanted = sum(map(_size, own.uses))
        problem = f"{wanted / 1e9:,.3g} GB are to be kept here, {(size - wanted) / 1e9:,.3g} GB by others that run now"
        raise ClearwayError(f"{folder}: {problem}, the limit is {limit / 1e9:g} GB. Set {LIMIT_VARIABLE} to more")
    free = [entry for entry in os.scandir(folder) if entry.name not in used and _is_entry(entry.name)]
    size += sum(_size(entry.name) for entry in free)
    for entry in sorted(free, key=lambda entry: entry.stat().st_mtime):
        if size <= limit:
            break
        shutil.rmtree(entry.path)
        size -= _size(entry.name)


def _limit_bytes() -> float:
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
        picture_progress("fetching", len(files), show_progress, unit="files") as show_done,
        ThreadPoolExecutor(AT_ONCE) as pool,
    ):

        def fetch(file: RemoteFile) -> None:
            new = part / _entry(file)
            new.mkdir()
            files[file].download(file, new / file.name)
            try:
                new.replace(folder / new.name)
            except OSError:
                if not (folder / new.name / file.name).exists():  # else another process or thread was faster
                    raise

        waiting = [pool.submit(fetch, file) for file in files]
        try:
            for done, future in enumerate(waiting, 1):
                future.result()
                show_done(done)
        finally:
            for future in waiting:
                future.cancel()


def _entry(file: RemoteFile) -> str:
    """The name of a file's folder: what it is, and its bytes."""
    digest = hashlib.sha256(f"{file.address}\n{file.version}".encode()).hexdigest()
    return f"{digest[:32]}-{file.size}"


def _is_entry(name: str) -> bool:
    digest, _, size = name.partition("-")
    return len(digest) == 32 and size.isdigit()


def _size(entry: str) -> int:
    return int(entry.partition("-")[2])
