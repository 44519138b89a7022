"""Scene files in zip archives, unpacked with care: no names that lead elsewhere, no links, no bombs."""

from __future__ import annotations

import os
import stat
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from clearway.errors import SceneError, reason_of
from clearway.regular_files import opened

ZIP_SUFFIX = ".zip"
MAX_MEMBERS = 10_000
MAX_BYTES = 64 * 1024**3  # of all scene files of an archive together, unpacked
MAX_RATIO = 200  # unpacked bytes for each packed one, of a file and of all together, beyond the first MiB
PACKING = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # what `zipfile` unpacks piece by piece
BLOCK_BYTES = 1024**2
GET_ANOTHER = "Get another copy, or unpack it yourself and give the files"
_FAULTS = (
    OSError,
    EOFError,
    LookupError,  # zipfile's own, for a member without a name
    ValueError,
    RuntimeError,
    MemoryError,
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)


@contextmanager
def unpacked(paths: Sequence[Path], suffixes: Sequence[str]) -> Iterator[list[Path]]:
    """The same paths, each zip archive among them replaced by the files in it that end in one of the suffixes.

    Unpacked files are gone afterwards. Folders in an archive do not matter.

    Raises:
        SceneError: an archive is damaged, too large, holds no such file, two of one name, or one that is unsafe. One
            about an unpacked file, raised within, names the archive in place of where it was unpacked.
    """
    with tempfile.TemporaryDirectory(prefix="clearway-") as folder:
        found: list[Path] = []
        for number, path in enumerate(paths):
            if path.suffix.lower() == ZIP_SUFFIX and path.is_file():
                found += _unpack(path, Path(folder) / str(number), tuple(suffixes))
            else:
                found.append(path)
        try:
            yield found
        except SceneError as fault:
            unpacked_to = Path(fault.source)
            if not unpacked_to.is_relative_to(folder):
                raise
            archive, name = unpacked_to.relative_to(folder).parts
            raise SceneError(paths[int(archive)] / name, fault.problem, fault.remedy, fault.dataset) from fault


def _unpack(path: Path, folder: Path, suffixes: tuple[str, ...]) -> list[Path]:
    folder.mkdir()
    try:
        with opened(path) as file, zipfile.ZipFile(file) as archive:
            members = _wanted(path, archive, suffixes)
            size = os.fstat(file.fileno()).st_size
            left = min(MAX_BYTES, BLOCK_BYTES + MAX_RATIO * size)  # members may share their bytes
            for name, member in members.items():
                left -= _copy(path, archive, member, folder / name, left)
    except _FAULTS as fault:
        raise SceneError(path, f"cannot be unpacked ({reason_of(fault)})", GET_ANOTHER) from fault
    return sorted(folder.iterdir())


def _wanted(path: Path, archive: zipfile.ZipFile, suffixes: tuple[str, ...]) -> dict[str, zipfile.ZipInfo]:
    """The members to unpack, by their names without folders.

    Every member is looked at, because a bad one makes the whole archive suspect.
    """
    members = archive.infolist()
    if len(members) > MAX_MEMBERS:
        raise SceneError(path, f"holds {len(members)} files, expected up to {MAX_MEMBERS}", GET_ANOTHER)
    wanted: dict[str, zipfile.ZipInfo] = {}
    for member in members:
        name = PurePosixPath(member.filename.replace("\\", "/"))
        if name.is_absolute() or ".." in name.parts or ":" in member.filename:
            raise SceneError(path, f"holds {member.filename[:80]!r}, which leads out of the archive", GET_ANOTHER)
        if stat.S_ISLNK(member.external_attr >> 16):
            raise SceneError(path, f"holds the link {member.filename[:80]!r}", GET_ANOTHER)
        if member.is_dir() or name.suffix.lower() not in suffixes:
            continue
        if member.compress_type not in PACKING:
            problem = f"holds {member.filename[:80]!r}, packed by method {member.compress_type}"
            raise SceneError(path, problem, "Pack it again with deflate, or unpack it yourself and give the files")
        if name.name in wanted:
            raise SceneError(path, f"holds two files named {name.name!r}", GET_ANOTHER)
        wanted[name.name] = member
    if not wanted:
        raise SceneError(path, f"holds no scene file ({', '.join(suffixes)})", "Give another archive")
    return wanted


def _copy(path: Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo, target: Path, most: int) -> int:
    """Unpack a member and count its bytes, whatever the archive says about its size."""
    most = min(most, BLOCK_BYTES + MAX_RATIO * member.compress_size)
    written = 0
    with archive.open(member) as packed, target.open("xb") as file:
        while block := packed.read(BLOCK_BYTES):
            written += len(block)
            if written > most:
                raise SceneError(path, f"{member.filename[:80]!r} unpacks to more than {most:,} bytes", GET_ANOTHER)
            file.write(block)
    return written
