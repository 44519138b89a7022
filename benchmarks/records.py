"""Keep what a reproduction was made of in one small file, and make its folder of it again.

    python benchmarks/records.py pack reproduction docs/records/memory.tar.xz
    python benchmarks/records.py unpack docs/records/memory.tar.xz again && clearway report again
    python benchmarks/records.py pack reproduction docs/records/rooms.tar.xz --only scenes    # once, as they are large
    python benchmarks/records.py pack reproduction docs/records/runs.tar.xz --only runs
    python benchmarks/records.py unpack docs/records/rooms.tar.xz docs/records/runs.tar.xz again

Kept are settings, metrics and every episode of every run, and the scenes, given ones too, but for their pictures; not
the weights, nor where the folder lay.
Of unpacked records a report is made as of the folder itself; nothing is trained.
"""

from __future__ import annotations

import argparse
import io
import json
import lzma
import re
import sys
import tarfile
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

from clearway.errors import ClearwayError, reason_of
from clearway.experiments.job import RUNS, TRIALS
from clearway.experiments.request_file import REQUEST_FILE
from clearway.experiments.setting import SCENES
from clearway.files import folder_written_whole, read_json, written_whole
from clearway.scenes.scene_files import SCENE_SUFFIXES
from clearway.scenes.thor_v1 import read_scene, write_scene

GIVEN = f"{SCENES}/given"
"""Where scenes that were given lie in a record."""
OF_A_RUN = ("run.json", "metrics.jsonl", f"{TRIALS}/*.json")


def pack(folder: Path, record: Path, parts: Sequence[str] = (SCENES, RUNS)) -> None:
    """Write the record of parts of a reproduction's folder, the same bytes whenever it is the same.

    Scenes that were given (`--scenes`), wherever they lie, are kept, too.
    """
    given = {f"{GIVEN}/{path.name}": path for path in _given(folder)}
    files = {path.relative_to(folder).as_posix(): path for path in _kept(folder, parts)}
    files |= given if SCENES in parts else {}
    places = [folder, *dict.fromkeys(path.parent for path in given.values())]
    with written_whole(record) as part, tarfile.open(part, "w:xz", preset=9) as archive:
        for name, path in sorted(files.items()):
            if path.suffix in SCENE_SUFFIXES:
                content = _without_pictures(path)
            elif name == REQUEST_FILE and given:
                content = _by_its_name(json.dumps(read_json(path) | {"dumps": [*given]}, indent=2).encode(), places)
            else:
                content = _by_its_name(path.read_bytes(), places)
            _add(archive, name, content)


def unpack(records: Sequence[Path], folder: Path) -> None:
    """Make the folder of one or more records, which must not be there yet; whole, or not at all.

    Raises:
        TarError: a file is no record, or a damaged one.
        OSError: a file cannot be read, or the folder cannot be written.
    """
    with folder_written_whole(folder) as part:
        for record in records:
            try:
                with tarfile.open(record, "r:xz") as archive:
                    for member in archive:
                        _extract(archive, member, part)
            except (EOFError, tarfile.TarError, lzma.LZMAError) as error:
                told = f"{record}: {reason_of(error)}, expected a .tar.xz file that records.py pack wrote"
                raise tarfile.TarError(told) from error


def _extract(archive: tarfile.TarFile, member: tarfile.TarInfo, folder: Path) -> None:
    """Write a file of a record below a folder. Raises TarError where it is no such file."""
    name = PurePosixPath(member.name)
    content = archive.extractfile(member) if member.isfile() else None
    if content is None or name.is_absolute() or ".." in name.parts:
        raise tarfile.TarError(f"{member.name!r:.80} is no file of a record")
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content.read())


def _kept(folder: Path, parts: Sequence[str]) -> Iterator[Path]:
    if SCENES in parts:
        yield from (folder / SCENES).rglob("*.h5")
    if RUNS in parts:
        yield from folder.glob("*.json")
        for pattern in OF_A_RUN:
            yield from (folder / RUNS).glob(f"*/{pattern}")


def _add(archive: tarfile.TarFile, name: str, content: bytes) -> None:
    entry = tarfile.TarInfo(name)
    entry.size = len(content)
    archive.addfile(entry, io.BytesIO(content))


def _given(folder: Path) -> list[Path]:
    """The scenes that the reproduction was given."""
    return [folder / path for path in read_json(folder / REQUEST_FILE)["dumps"]]


def _by_its_name(content: bytes, places: Sequence[Path]) -> bytes:
    """What a file holds, without where on this machine some folders and the command lie."""
    for place in map(Path.resolve, places):
        below_root = place.parent == place.parent.parent  # whose slash is part of every path
        told = str(place) if below_root else f"{place.parent}/"
        for text in dict.fromkeys((told, json.dumps(told)[1:-1])):  # as it is, and as JSON files have it
            if below_root:
                content = re.sub(rb"(?<![\w./-])/(?=" + re.escape(text[1:]).encode() + rb"(?![\w.-]))", b"", content)
            else:
                content = content.replace(text.encode(), b"")
    return re.sub(rb'"/[^"]*/clearway"', b'"clearway"', content)


def _without_pictures(path: Path) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        bare = Path(folder) / path.name
        write_scene(replace(read_scene(path), observations=None, further=(), top_view=None), bare)
        return bare.read_bytes()


def _pack(folder: Path, record: Path, parts: Sequence[str]) -> None:
    """As `pack`, with faults in one line."""
    if not (folder / REQUEST_FILE).exists():
        sys.exit(f"error: {folder}: no reproduction here. Name a folder that clearway reproduce made")
    try:
        given = _given(folder)
        if len({path.name for path in given}) < len(given):
            sys.exit(f"error: {folder}: two of its scenes' files have one name. Rename one, and run its command again")
        here = {SCENES: [*given, *(folder / SCENES).rglob("*.h5")], RUNS: [*(folder / RUNS).glob("*/run.json")]}
        if lacking := [part for part in parts if not here[part]]:
            sys.exit(f"error: {folder}: holds no {' and no '.join(lacking)} to pack. Run its command first")
        pack(folder, record, parts)
    except (OSError, ValueError, KeyError, TypeError, ClearwayError) as error:
        sys.exit(f"error: {error}. Name a folder that clearway reproduce made, and a place for its record")
    except KeyboardInterrupt:
        sys.exit("interrupted: nothing was packed")


def main() -> None:
    """Pack or unpack."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("pack", "unpack"))
    parser.add_argument("source", type=Path, nargs="+", help="a folder to be packed, or records to be unpacked")
    parser.add_argument("made", type=Path, help="the record, or the folder")
    parser.add_argument("--only", choices=(SCENES, RUNS), help="pack these alone")
    args = parser.parse_args()
    if args.what == "pack":
        if len(args.source) != 1:
            sys.exit(f"error: {len(args.source)} folders for one record. Pack them one by one")
        _pack(args.source[0], args.made, (args.only,) if args.only else (SCENES, RUNS))
    elif args.only:
        sys.exit("error: --only is for packing. Leave it out")
    elif args.made.exists():
        sys.exit(f"error: {args.made}: is there already. Name a new folder")
    else:
        try:
            unpack(args.source, args.made)
        except (OSError, tarfile.TarError) as error:
            sys.exit(f"error: {error}. Name records of docs/records, and a new folder")
        except KeyboardInterrupt:
            sys.exit("interrupted: nothing was unpacked")


if __name__ == "__main__":
    main()
