"""Where files came from that were fetched: a record each, by which a file comes again, on this machine or another."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from clearway.errors import ClearwayError
from clearway.files import cache_faults_named, json_text, locked, read_json
from clearway.regular_files import read_text
from clearway.remote.address import ENTRY, fetched_folder, file_name, is_fetched, without_secrets

RECORDS = ".records"  # in the cache folder, by the entry's name
MAX_RECORD_BYTES = 64 * 1024
_NO_RECORD = (OSError, ValueError, KeyError, TypeError)


def record_text(address: str, version: str) -> str:
    """The record of a file: where it is, and which one, but no secrets."""
    return json_text({"address": without_secrets(address), "version": version})


def write_records(folder: Path, texts: Mapping[str, str]) -> None:
    """Write records down, by entry, under the lock of a cache folder."""
    records = folder / RECORDS
    records.mkdir(parents=True, exist_ok=True)
    known = {entry.name: entry.stat().st_size for entry in os.scandir(records)}
    for entry, text in texts.items():
        content = text.encode()
        if known.get(entry) != len(content):
            part = records / ".part"
            part.unlink(missing_ok=True)  # of one who was killed; it may even lead elsewhere
            with part.open("xb") as file:
                file.write(content)
            part.replace(records / entry)


def recorded_address(place: Path) -> str:
    """Where a file came from that was fetched. Raises ClearwayError where its record has gone, too."""
    try:
        return _address(place)
    except _NO_RECORD as fault:
        problem = "has gone, and its record, too"
        raise ClearwayError(f"{place}: {problem}. Begin again with the address that it came from") from fault


def origin(path: Path) -> str:
    """Where a file can be had again: the address of one that was fetched, where that is known; else the whole path."""
    path = path.resolve()
    if is_fetched(path):
        with suppress(*_NO_RECORD):
            return _address(path)
    return str(path)


def with_origins(text: str) -> str:
    """A text in which files that were fetched are named by their addresses."""
    for entry in re.finditer(rf"{re.escape(str(fetched_folder()))}/{ENTRY.pattern}/", text):
        with suppress(*_NO_RECORD):
            address = _address(Path(entry[0]) / "any")
            text = text.replace(entry[0] + file_name(address), address)
    return text


def records_of(paths: Iterable[Path]) -> dict[str, str]:
    """For another machine: the records, by entry, of those files that were fetched."""
    folder, entries = fetched_folder() / RECORDS, [path.parent.name for path in paths if is_fetched(path)]
    return {entry: read_text(folder / entry, MAX_RECORD_BYTES) for entry in entries}


def take_records(texts: Mapping[str, str]) -> None:
    """What `records_of` gave on another machine: files of the same paths come here, too, when they are read.

    Raises:
        ClearwayError: the cache folder cannot be written to.
    """
    if texts:
        folder = fetched_folder()
        with cache_faults_named(folder), locked(folder / ".cache"):
            write_records(folder, texts)


def _address(place: Path) -> str:
    return str(read_json(place.parent.parent / RECORDS / place.parent.name, MAX_RECORD_BYTES)["address"])
