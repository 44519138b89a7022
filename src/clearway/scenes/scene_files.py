"""Which scene files some paths and addresses name; those elsewhere are fetched."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from clearway.errors import ClearwayError
from clearway.remote.address import address_of, is_fetched

SCENE_SUFFIXES = (".h5", ".hdf5")


def scene_files(paths: Sequence[Path]) -> list[Path]:
    """The scene files that some paths name: files as they are, folders by the scene files in them.

    An address that starts with s3://, gs:// or https:// is a path, too; its files come from a cache on this machine.

    Raises:
        ClearwayError: a path does not exist, a folder holds no scene file, or an address cannot be read.
    """
    files: list[Path] = []
    for path in paths:
        if (address := address_of(path)) is not None:
            from clearway.remote.cache import fetched

            files += fetched([address], SCENE_SUFFIXES, may_pass=True)  # `hdf5.opened` has them come
        elif path.is_dir():
            found = sorted(p for p in path.iterdir() if p.suffix in SCENE_SUFFIXES)
            if not found:
                raise ClearwayError(f"{path}: no scene file ({', '.join(SCENE_SUFFIXES)}) in this folder. Name another")
            files += found
        elif path.exists() or is_fetched(path):
            files.append(path)
        else:
            raise ClearwayError(f"{path}: no such file. Check the path, or make a scene with clearway scenes build")
    if not files:
        raise ClearwayError("no scene file given. Name at least one, or make one with clearway scenes build")
    return files
