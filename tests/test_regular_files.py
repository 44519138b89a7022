"""The door for files that are read: regular files alone, read to a limit; and no way in beside it."""

import ast
import hashlib
import os
import socket
import sys
import threading
from pathlib import Path

import pytest

import clearway
from clearway import regular_files

PACKAGE = Path(clearway.__file__).parent
posix = pytest.mark.skipif(sys.platform == "win32", reason="has no such files")


def test_a_file_is_read_up_to_its_limit(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"1234")
    assert regular_files.read_bytes(path, 4) == b"1234"
    with pytest.raises(OSError, match="larger than 3 bytes") as caught:
        regular_files.read_bytes(path, 3)
    assert caught.value.filename == str(path)


def test_a_text_keeps_its_line_ends(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes("ä\r\n".encode())
    assert regular_files.read_text(path, 10) == "ä\r\n"
    with pytest.raises(UnicodeDecodeError):
        regular_files.read_text(path, 10, "ascii")


@posix
@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ("pipe", "it is a pipe, no regular file"),
        ("device", "it is a device, no regular file"),
        ("folder", "Is a directory"),
        ("missing", "No such file or directory"),
        ("nobody's name", "No such file or directory"),
        ("socket", "No such device or address"),
    ],
)
def test_what_is_no_regular_file_is_refused_at_once(kind: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "file"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "folder":
        path.mkdir()
    elif kind == "nobody's name":
        path = Path(f"{path}\0")
    with socket.socket(socket.AF_UNIX) as server:
        if kind == "socket":
            server.bind(str(path))
        with pytest.raises(OSError, match=said) as caught:
            regular_files.read_bytes(path, 1 << 40)
    assert caught.value.filename == str(path)


def test_a_file_that_grows_is_read_no_further_than_its_limit(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"")
    done = threading.Event()

    def grow() -> None:
        with path.open("ab") as file:
            while not done.is_set():
                file.write(bytes(1 << 16))

    writer = threading.Thread(target=grow)
    with regular_files.opened(path) as file:
        writer.start()
        try:
            while os.fstat(file.fileno()).st_size < 1 << 20:
                pass
            with pytest.raises(OSError, match="larger than 1000 bytes"):
                regular_files.read_at_most(file, 1000, path)
        finally:
            done.set()
            writer.join()


def test_sums_and_pieces_are_of_the_whole_file(tmp_path: Path) -> None:
    path = tmp_path / "file"
    content = os.urandom(2 * regular_files.BLOCK_BYTES + 5)
    path.write_bytes(content)
    assert b"".join(regular_files.blocks_of(path)) == content
    assert regular_files.sha256_of(path) == hashlib.sha256(content).hexdigest()


OPENERS = {
    "open",
    "io.open",
    "os.open",
    "h5py.File",
    "h5py.is_hdf5",
    "np.load",
    "np.loadtxt",
    "np.genfromtxt",
    "np.fromfile",
    "np.memmap",
    "Image.open",
    "zipfile.ZipFile",
    "tarfile.open",
    "safe_open",
    "load_file",
    "av.open",
    "onnx.load",
    "ElementTree.parse",
    "plt.imread",
    "AutoModel.from_pretrained",
    "onnxruntime.InferenceSession",
}
MUJOCO = {"from_file", "from_string", "from_zip", "from_xml_path", "from_xml_string", "from_binary_path"}
METHODS = {"open", "read_text", "read_bytes", *MUJOCO}
WRITES = "wax"
DOOR = "regular_files.py"
CONTENT = {"file", "io.BytesIO(content)", "io.BytesIO(jpeg)", "content"}
"""Names of what the door has opened or read, where it is handed on to a library."""
BESIDE = {
    ("archives.py", "archive.open(member)"): "a member of an archive that the door has opened",
    ("cached.py", "source.read_bytes()"): "the package's own code",
    ("library.py", "source.read_bytes()"): "the package's own code",
    ("content.py", "file.read_bytes()"): "the package's own page",
    ("server.py", "path.read_bytes()"): "a film, written just before into a folder of our own",
    ("provenance.py", "CPU_INFO.read_text(encoding='utf-8', errors='replace')"): "the system's",
    ("checkpoint.py", "os.open(path, os.O_RDONLY)"): "flushes what was just written, and reads nothing",
    ("files.py", "part.open('rb+')"): "flushes what was just written, and reads nothing",
    ("mapped_features.py", "place.path.open('r+b')"): "writes into a file of our own",
    ("own_number.py", "os.open(path, os.O_RDWR | os.O_CREAT, 384)"): "a lock of our own, of which nothing is read",
    ("browser.py", "os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 384)"): "writes",
    ("main.py", "os.open(os.devnull, os.O_WRONLY)"): "drops what cannot be printed",
    ("worker.py", "os.open(os.devnull, os.O_RDONLY)"): "stands in for standard input",
    ("hdf5.py", "h5py.h5o.open(parent.id, name.encode())"): "an object of a file that the door has opened",
    ("hdf5.py", "h5py.h5a.open(item.id, name.encode())"): "an attribute of it",
    ("hdf5.py", "h5py.is_hdf5(name)"): "of what the door has opened: the library wants names",
    ("hdf5.py", "h5py.File(name, 'r')"): "of what the door has opened: the library wants names",
    ("mjcf_compile.py", "mujoco.MjSpec.from_string(EMPTY)"): "names no file",
    ("mjcf_compile.py", "mujoco.MjSpec.from_string(files.text, include=files.models, assets=files.assets)"): (
        "in a process that can open nothing, see tests/importers/test_mjcf_compile.py"
    ),
    ("render_worker.py", "mujoco.MjModel.from_binary_path(MODEL_FILE, {MODEL_FILE: content})"): "compiled by us",
    ("pretrained.py", "AutoModel.from_pretrained"): "after all of its files were read through the door, for their hash",
    ("app.py", "service.open"): "a session",
    ("service.py", "self.sessions.open"): "a session",
}
"""Calls that may open a file beside the door, and why they may."""


def openings(source: str, name: str) -> list[str]:
    """Calls in a module's source that read a file past the door."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Call):
            continue
        called, text = ast.unparse(node.func), ast.unparse(node)
        is_method = isinstance(node.func, ast.Attribute) and node.func.attr in METHODS
        if called not in OPENERS and not is_method:
            continue
        if (name, text) in BESIDE or (name, called) in BESIDE or _writes(node) or _is_handed(node):
            continue
        found.append(f"line {node.lineno}: {text}")
    return found


def _writes(node: ast.Call) -> bool:
    """A mode that begins a new file, or appends to one."""
    words = [word.value for word in node.args if isinstance(word, ast.Constant) and isinstance(word.value, str)]
    return any(word and word[0] in WRITES and len(word) <= 3 for word in words)


def _is_handed(node: ast.Call) -> bool:
    """What comes first is open already, or the content itself."""
    return bool(node.args) and ast.unparse(node.args[0]) in CONTENT


@pytest.mark.parametrize(
    "path",
    [path for path in sorted(PACKAGE.rglob("*.py")) if path.name != DOOR],
    ids=lambda path: str(path.relative_to(PACKAGE)),
)
def test_files_are_read_through_the_door(path: Path) -> None:
    past = openings(path.read_text(encoding="utf-8"), path.name)
    assert not past, f"{past}: read it with clearway.regular_files"


@pytest.mark.parametrize(
    "source",
    [
        "open(path)",
        "open(path, 'rb+')",
        "path.read_text()",
        "path.open()",
        "h5py.File(path)",
        "Image.open(io.BytesIO(path.read_bytes()))",
        "zipfile.ZipFile(path)",
        "os.open(path, os.O_RDONLY)",
        "mujoco.MjModel.from_xml_path(str(path))",
        "mujoco.MjSpec.from_file(str(path))",
    ],
)
def test_a_way_past_the_door_would_be_noticed(source: str) -> None:
    assert openings(source, "module.py")


@pytest.mark.slow
def test_what_may_pass_beside_the_door_is_there() -> None:
    there = {(path.name, ast.unparse(node)) for path in PACKAGE.rglob("*.py") for node in _calls(path)}
    there |= {(path.name, ast.unparse(node.func)) for path in PACKAGE.rglob("*.py") for node in _calls(path)}
    assert not set(BESIDE) - there


def _calls(path: Path) -> list[ast.Call]:
    return [node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, ast.Call)]


@pytest.mark.skipif(not hasattr(os, "posix_fadvise"), reason="the system fetches nothing ahead")
def test_small_regular_files_are_fetched_ahead(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    small, large, pipe = (tmp_path / name for name in ("small", "large", "pipe"))
    small.write_bytes(b"12")
    with large.open("wb") as file:
        file.truncate(regular_files.AHEAD_BYTES + 1)
    os.mkfifo(pipe)
    fetched = []
    monkeypatch.setattr(os, "posix_fadvise", lambda handle, *how: fetched.append((os.fstat(handle).st_size, how)))
    regular_files.read_ahead([tmp_path / "gone", pipe, large, tmp_path, small])
    assert fetched == [(2, (0, 0, os.POSIX_FADV_WILLNEED))]
