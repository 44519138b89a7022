"""Which scene files some paths and addresses name; those elsewhere are fetched."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from pathlib import Path

from clearway.errors import ClearwayError
from clearway.remote.address import address_of, is_fetched

SCENE_SUFFIXES = (".h5", ".hdf5")


def scene_files(paths: Sequence[Path], made_by: str = "clearway scenes build") -> list[Path]:
    """The scene files that some paths name: files as they are, folders by the scene files in them.

    An address that starts with s3://, gs:// or https:// is a path, too; its files come from a cache on this machine,
    those of all addresses together.

    Args:
        paths: files, folders, addresses.
        made_by: the command that makes such files, for messages.

    Raises:
        ClearwayError: a path does not exist, a folder holds no scene file, or an address cannot be read.
    """
    if not paths:
        raise ClearwayError(f"no scene file given. Name at least one, or make one with {made_by}")
    return list(chain.from_iterable(scene_files_of_each(paths, made_by)))


def scene_files_of_each(paths: Sequence[Path], made_by: str = "clearway scenes build") -> list[list[Path]]:
    """As `scene_files`, those of each path by themselves."""
    addresses = {path: address for path in paths if (address := address_of(path)) is not None}
    found = {path: _files_here(path, made_by) for path in paths if path not in addresses}
    if addresses:
        from clearway.remote.cache import fetched_each

        there = fetched_each(list(addresses.values()), SCENE_SUFFIXES, may_pass=True)  # `hdf5.opened` has them come
        found |= dict(zip(addresses, there, strict=True))
    return [found[path] for path in paths]


def _files_here(path: Path, made_by: str) -> list[Path]:
    if path.is_dir():
        found = sorted(p for p in path.iterdir() if p.suffix in SCENE_SUFFIXES)
        if not found:
            raise ClearwayError(f"{path}: no scene file ({', '.join(SCENE_SUFFIXES)}) in this folder. Name another")
        return found
    if path.exists() or is_fetched(path):
        return [path]
    raise ClearwayError(f"{path}: no such file. Check the path, or make it with {made_by}")
