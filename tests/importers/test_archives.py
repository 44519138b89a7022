import stat
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from clearway.errors import SceneError
from clearway.importers import archives
from clearway.importers.archives import unpacked
from clearway.scenes.thor_v1 import read_scene, write_scene
from helpers.made import corridor_scene

SUFFIXES = (".h5", ".hdf5")


def zipped(path: Path, members: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return path


def test_scene_files_of_an_archive_stand_beside_plain_ones(tmp_path: Path) -> None:
    write_scene(corridor_scene(3), tmp_path / "plain.h5")
    write_scene(corridor_scene(4), tmp_path / "in.h5")
    content = (tmp_path / "in.h5").read_bytes()
    archive = zipped(
        tmp_path / "dumps.zip", {"data/in.h5": content, "data/readme.txt": b"hello", "data/b.HDF5": content}
    )
    with unpacked([archive, tmp_path / "plain.h5"], SUFFIXES) as files:
        assert [file.name for file in files] == ["b.HDF5", "in.h5", "plain.h5"]
        assert read_scene(files[1]).state_count == 16
    assert not files[0].exists() and files[2].exists()


def test_names_of_other_systems_are_those_behind_the_last_folder(tmp_path: Path) -> None:
    write_scene(corridor_scene(3), tmp_path / "in.h5")
    archive = zipped(tmp_path / "dumps.zip", {"scenes\\p.h5": (tmp_path / "in.h5").read_bytes()})
    with unpacked([archive], SUFFIXES) as files:
        assert [file.name for file in files] == ["p.h5"]


def test_a_folder_named_like_an_archive_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "dumps.zip").mkdir()
    with unpacked([tmp_path / "dumps.zip"], SUFFIXES) as files:
        assert files == [tmp_path / "dumps.zip"]


def add_link(path: Path) -> None:
    member = zipfile.ZipInfo("scene.h5")
    member.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(member, "/etc/passwd")


def understate(path: Path) -> None:
    """A member that unpacks to far more than the archive says."""
    zipped(path, {"scene.h5": bytes(20_000_000)})
    content = path.read_bytes().replace((20_000_000).to_bytes(4, "little"), (20_000).to_bytes(4, "little"))
    path.write_bytes(content)


@pytest.mark.parametrize(
    ("make", "parts"),
    [
        (lambda path: path.write_bytes(b"no archive"), ("cannot be unpacked",)),
        (lambda path: path.write_bytes(zipped(path, {"a.h5": bytes(999)}).read_bytes()[:60]), ("cannot be unpacked",)),
        (lambda path: zipped(path, {"readme.txt": b"hello"}), ("no scene file",)),
        (lambda path: zipped(path, {"../scene.h5": b"x"}), ("leads out of the archive",)),
        (lambda path: zipped(path, {"a/../../scene.txt": b"x"}), ("leads out of the archive",)),
        (lambda path: zipped(path, {"/etc/scene.h5": b"x"}), ("leads out of the archive",)),
        (lambda path: zipped(path, {"..\\scene.h5": b"x"}), ("leads out of the archive",)),
        (lambda path: zipped(path, {"C:/scene.h5": b"x"}), ("leads out of the archive",)),
        (lambda path: zipped(path, {"a/scene.h5": b"x", "b/scene.h5": b"y"}), ("two files named 'scene.h5'",)),
        (lambda path: zipped(path, {"scene.h5": bytes(20_000_000)}), ("unpacks to more than",)),
        (add_link, ("the link 'scene.h5'",)),
        (understate, ("dumps.zip",)),
    ],
)
def test_what_is_unsafe_or_broken_is_refused(make: Callable[[Path], object], parts: tuple, tmp_path: Path) -> None:
    path = tmp_path / "dumps.zip"
    make(path)
    with pytest.raises(SceneError) as caught, unpacked([path], SUFFIXES):
        pytest.fail("unpacked")
    assert str(caught.value).startswith(str(path))
    for part in parts:
        assert part in str(caught.value)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["dumps.zip"]


def test_an_encrypted_archive_is_refused(tmp_path: Path) -> None:
    path = zipped(tmp_path / "dumps.zip", {"scene.h5": b"x" * 100})
    content = bytearray(path.read_bytes())
    content[6] |= 1  # general purpose flag of the member
    content[content.index(b"PK\x01\x02") + 8] |= 1  # and of its entry in the directory
    path.write_bytes(content)
    with pytest.raises(SceneError, match=r"cannot be unpacked.*encrypted"), unpacked([path], SUFFIXES):
        pytest.fail("unpacked")


def test_limits_hold_for_all_members_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = zipped(tmp_path / "dumps.zip", {f"{k}.h5": bytes(1000) for k in range(5)})
    monkeypatch.setattr(archives, "MAX_BYTES", 4_500)
    with pytest.raises(SceneError, match="unpacks to more than 500 bytes"), unpacked([path], SUFFIXES):
        pytest.fail("unpacked")
    monkeypatch.setattr(archives, "MAX_MEMBERS", 4)
    with pytest.raises(SceneError, match="holds 5 files, expected up to 4"), unpacked([path], SUFFIXES):
        pytest.fail("unpacked")
