"""The files that a MuJoCo model names: regular ones in the model's folder or below it, read through the door.

MuJoCo opens whatever a model names. So it is handed these files by name, and may open none itself (see `mjcf_compile`):
a name that is overlooked here is not found there.
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

from clearway.errors import SceneError, reason_of
from clearway.regular_files import MIB, read_bytes

MAX_FILES, MAX_NAMES = 10_000, 100_000
MAX_BYTES, MAX_TEXT_BYTES = 1024 * MIB, 256 * MIB
MODELS = ("include", "model")  # elements whose file is a model too
FOLDERS = ("meshdir", "texturedir", "assetdir")  # attributes
PACKAGE = "package://"
NAME_LENGTH = 80
REMEDY = "Correct the model; the files that it names must lie where it says"
IMPORT_AGAIN = "Import the model again (clearway scenes import mjcf)"
TRUST_REMEDY = "Move its files into its folder, or import it with --trust where you trust it"


@dataclass
class ModelFiles:
    """A model, and what it names.

    Attributes:
        text: the model's own file.
        models: files that are included or attached, by the names under which MuJoCo looks for them.
        assets: meshes, textures and height fields, likewise.
        outside: SHA-256 of those outside the model's folder; empty where there are none.
    """

    text: bytes
    models: dict[str, bytes] = field(default_factory=dict)
    assets: dict[str, bytes] = field(default_factory=dict)
    outside: str = ""


class _Document:
    """What the text of a model names: models, other files, folders of files.

    Raises:
        ValueError: it is no XML, or declares a document type, of which MuJoCo knows nothing.
    """

    def __init__(self, text: bytes) -> None:
        self.root = ""
        self.models: dict[str, None] = {}
        self.assets: dict[str, None] = {}
        self.folders: dict[str, None] = {}
        self.strips_paths = False
        parser = expat.ParserCreate()
        parser.StartElementHandler, parser.StartDoctypeDeclHandler = self._begin, self._refuse_type
        try:
            parser.Parse(text, True)
        except expat.ExpatError as fault:
            raise ValueError(f"it is no XML ({fault})") from fault

    @property
    def is_urdf(self) -> bool:
        """There MuJoCo leaves out what is only seen, whose files may be missing, and looks at names' last parts."""
        return self.root == "robot"

    def _begin(self, element: str, attributes: dict[str, str]) -> None:
        self.root = self.root or element
        for name, value in attributes.items():
            if name.startswith("file") and value:
                (self.models if element in MODELS else self.assets)[value] = None
            elif name in FOLDERS:
                self.folders[_with_slashes(value)] = None
            elif name == "strippath":
                self.strips_paths |= value == "true"

    def _refuse_type(self, *_: object) -> None:
        raise ValueError("it declares a document type")


def _with_slashes(name: str) -> str:
    return name.removeprefix(PACKAGE).replace("\\", "/")


def files_of_model(path: Path, *, trust: bool | str = False) -> ModelFiles:
    """Everything that MuJoCo needs to compile a model.

    Args:
        path: the MJCF or URDF file.
        trust: its files may lie anywhere; as a text, only such files outside its folder whose SHA-256 that is.

    Raises:
        SceneError: there is no such file or no XML in it; it names a file that is missing, lies outside its folder or
            is no regular one; or there are more files, or more in them, than the limits.
    """
    return _Reading(path, trust).whole()


class _Reading:
    """Files of one model, read one after the other."""

    def __init__(self, path: Path, trust: bool | str) -> None:
        self.path, self.trust = path, trust
        self.home = path.resolve().parent
        self.left_bytes, self.left_files, self.left_names = MAX_BYTES, MAX_FILES, MAX_NAMES
        self.outside = hashlib.sha256()
        self.has_outside = False

    def whole(self) -> ModelFiles:
        """The model with all that it names."""
        text = self._read(self.path.resolve(), self.path.name)
        if text is None:
            raise SceneError(self.path, "there is no such file", "Check the path")
        found = ModelFiles(text)
        left, documents, seen = [("", text)], list[tuple[str, _Document]](), {self.path.resolve()}
        while left:
            folder, text = left.pop()
            document = self._document(text)
            documents.append((folder, document))
            for name in document.models:
                keys = self._take(name, {"": None, folder: None}, found.models, document)
                new = {self._place(key, name): key for key in keys}
                left += [(os.path.dirname(key), found.models[key]) for place, key in new.items() if place not in seen]
                seen |= set(new)
        self._take_assets(documents, found.assets)
        found.outside = self.outside.hexdigest() if self.has_outside else ""
        if isinstance(self.trust, str) and found.outside != self.trust:
            raise SceneError(self.path, "the files outside its folder have changed since it was imported", IMPORT_AGAIN)
        return found

    def _take_assets(self, documents: list[tuple[str, _Document]], into: dict[str, bytes]) -> None:
        """Read them where MuJoCo may look for them: beside the model or the document, or in a folder that one names."""
        folders = {folder: None for _, document in documents for folder in ("", *document.folders)}
        for base, document in documents:
            bases = {os.path.join(here, folder): None for here in ("", base) for folder in folders}
            for name in document.assets:
                self._take(name, bases, into, document)

    def _take(self, name: str, bases: dict[str, None], into: dict[str, bytes], document: _Document) -> list[str]:
        """Read what a name may mean in these folders; the keys of what was there."""
        names = [plain := _with_slashes(name)]
        if document.is_urdf or document.strips_paths:
            names.append(os.path.basename(plain))
        self.left_names -= len(bases)
        if self.left_names < 0:
            self._refuse(f"it names files in more than {MAX_NAMES:,} ways")
        keys = dict.fromkeys(os.path.join(base, each) for each in names for base in bases)
        found = [key for key in keys if self._is_taken(key, name, into)]
        if not found and any(self._is_stray(self._place(key, name)) for key in keys):
            self._refuse(f"it names {name[:NAME_LENGTH]!r}, which lies outside its folder", TRUST_REMEDY)
        if not found and not document.is_urdf:
            self._refuse(f"it names {name[:NAME_LENGTH]!r}, which is not there")
        return found

    def _is_taken(self, key: str, name: str, into: dict[str, bytes]) -> bool:
        """Whether there is a file that may be read; it is then."""
        if key in into:
            return True
        place = self._place(key, name)
        content = None if self._is_stray(place) else self._read(place, name)
        if content is None:
            return False
        into[key] = content
        if not place.is_relative_to(self.home):
            self.has_outside = True
            self.outside.update(hashlib.sha256(key.encode()).digest() + hashlib.sha256(content).digest())
        return True

    def _is_stray(self, place: Path) -> bool:
        return not self.trust and not place.is_relative_to(self.home)

    def _place(self, key: str, name: str) -> Path:
        """Where a key leads, links followed."""
        try:
            return (self.home / key).resolve()
        except (OSError, ValueError, RuntimeError) as fault:  # a loop of links, or a null byte
            raise SceneError(self.path, f"it names {name[:NAME_LENGTH]!r}, which is no path", REMEDY) from fault

    def _read(self, place: Path, name: str) -> bytes | None:
        """What a file holds; None where there is none."""
        try:
            content = read_bytes(place, self.left_bytes)
        except (FileNotFoundError, NotADirectoryError, IsADirectoryError):
            return None
        except OSError as fault:
            raise SceneError(self.path, f"{name[:NAME_LENGTH]!r}: {reason_of(fault)}", REMEDY) from fault
        self.left_bytes -= len(content)
        self.left_files -= 1
        if self.left_files < 0:
            self._refuse(f"it names more than {MAX_FILES:,} files")
        return content

    def _document(self, text: bytes) -> _Document:
        if len(text) > MAX_TEXT_BYTES:
            self._refuse(f"one of its texts is larger than {MAX_TEXT_BYTES // MIB} MiB")
        try:
            return _Document(text)
        except ValueError as fault:
            raise SceneError(self.path, str(fault), REMEDY) from fault

    def _refuse(self, problem: str, remedy: str = REMEDY) -> NoReturn:
        raise SceneError(self.path, problem, remedy)
