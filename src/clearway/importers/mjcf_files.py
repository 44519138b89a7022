"""The files that a MuJoCo model names: regular ones, in the model's folder or below it.

MuJoCo opens whatever a model names. What it may open is found by the letters of the text rather than by its meaning, so
that no other reading of the same text finds more: every attribute whose name begins with `file`, looked for in every
folder that any file of the model names.
"""

from __future__ import annotations

import os
import re
from html import unescape
from pathlib import Path, PurePosixPath

from clearway.regular_files import opened, read_at_most

MAX_FILES = 10_000
MAX_FILE_BYTES, MAX_TEXT_BYTES = 1 << 30, 1 << 28
BOM = b"\xef\xbb\xbf"
REMEDY = "Move its files into its folder, or give --trust where you trust the model"
_ATTRIBUTE = re.compile(r"""(?<![\w.])(file\w*|meshdir|texturedir|assetdir)\s*=\s*("[^"]*"|'[^']*')""")
_SCHEME = re.compile(r"\w+:")


class UnsafeModelError(ValueError):
    """A model that names what lies elsewhere, or is no regular file; one line."""


def check_files(model: Path, *, trust: bool = False) -> None:
    """Look at all files that a model names, the included ones and theirs too.

    Args:
        model: the file, a resolved path.
        trust: they may lie anywhere.

    Raises:
        UnsafeModelError: one lies outside the model's folder.
        OSError: one is no regular file, too large, or cannot be read; files that are not there are MuJoCo's to tell.
    """
    home, left = model.parent, [model]
    folders, names, tried, seen = {model.parent}, set[str](), set[tuple[Path, str]](), set[Path]()
    while left:
        path = left.pop()
        if path in seen or not path.exists():
            continue
        if len(seen) >= MAX_FILES:
            raise UnsafeModelError(f"it names more than {MAX_FILES:,} files")
        seen.add(path)
        found_folders, found_names = _named_in(path)
        folders |= {path.parent} if found_names else set()
        folders |= {_inside(home, base, name, trust) for base in (home, path.parent) for name in found_folders}
        names |= found_names
        new = {(folder, name) for folder in folders for name in names} - tried
        tried |= new
        left += [_inside(home, folder, name, trust) for folder, name in sorted(new)]


def _named_in(path: Path) -> tuple[set[str], set[str]]:
    """The folders and the files that a file names, where it is a text of XML."""
    with opened(path) as file:
        if os.fstat(file.fileno()).st_size > MAX_FILE_BYTES:
            raise UnsafeModelError(f"it names {path.name}, which is larger than {MAX_FILE_BYTES >> 30} GiB")
        if file.peek(4)[:4].removeprefix(BOM).lstrip()[:1] not in (b"<", b""):  # a mesh or a picture
            return set(), set()
        content = read_at_most(file, MAX_TEXT_BYTES, path)
    folders, files = set(), set()
    for name, quoted in _ATTRIBUTE.findall(content.decode("utf-8", "surrogateescape")):
        (folders if name.endswith("dir") else files).add(unescape(quoted[1:-1]))
    return folders, files


def _inside(home: Path, folder: Path, name: str, trust: bool) -> Path:
    """Where a name leads from a folder. Raises UnsafeModelError where that is not below the model's folder."""
    plain = name.removeprefix("package://").replace("\\", "/")
    try:
        path = (folder / plain).resolve()
    except (OSError, ValueError, RuntimeError) as fault:
        raise UnsafeModelError(f"it names {name[:80]!r}, which is no path") from fault
    if not trust and (_SCHEME.match(plain) or not path.is_relative_to(home)):
        raise UnsafeModelError(f"it names {str(PurePosixPath(name))[:80]!r}, which lies outside its folder")
    return path
