"""What a MuJoCo model names lies in its folder, however it is written, or is refused before MuJoCo sees anything."""

import os
from pathlib import Path

import pytest

from clearway.errors import SceneError
from clearway.importers import mjcf_files
from clearway.importers.mjcf_files import files_of_model

STRAY = "lies outside its folder. Move its files into its folder, or import it with --trust where you trust it"
OUTSIDE = {
    "up and out": '<mesh file="../secret"/>',
    "from the root": '<mesh file="/etc/passwd"/>',
    "in single quotes": "<mesh file = '../secret'/>",
    "over two lines": '<mesh file\n=\n"../secret"/>',
    "by backslashes": '<mesh file="..\\secret"/>',
    "by entities": '<mesh file="&#46;&#x2e;/secret"/>',
    "a side of a box": '<texture fileright="../secret"/>',
    "a height field": '<hfield file="../secret"/>',
    "a skin": '<skin file="../secret"/>',
    "a flex": '<flexcomp file="../secret"/>',
    "an attached model": '<model file="../secret"/>',
    "a folder of meshes": '<compiler meshdir=".."/><mesh file="secret"/>',
    "a folder of textures": '<texture file="secret"/><compiler texturedir="/etc/.."/>',
    "a folder and on": '<compiler assetdir="deep/../.."/><mesh file="secret"/>',
    "a folder from the root": '<compiler meshdir="/etc"/><mesh file="passwd"/>',
    "by a link": '<mesh file="link"/>',
    "by a link to a folder": '<mesh file="up/secret"/>',
    "an include": '<include file="../secret"/>',
    "through an included file": '<include file="more.xml"/>',
    "through an included file's folder": '<include file="deep/inner.xml"/>',
}


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A folder with links out of it, included files that name others, and something secret beside it."""
    (tmp_path / "secret").write_text("secret")
    folder = tmp_path / "home"
    (folder / "deep").mkdir(parents=True)
    (folder / "link").symlink_to(tmp_path / "secret")
    (folder / "up").symlink_to(tmp_path)
    written(folder, '<mesh file="../secret"/>', "more.xml")
    written(folder, '<mesh file="../../secret"/>', "deep/inner.xml")
    return folder


def written(folder: Path, words: str, name: str = "world.xml", root: str = "mujoco") -> Path:
    path = folder / name
    path.write_text(f"<{root}>{words}</{root}>")
    return path


def refusal(path: Path) -> str:
    with pytest.raises(SceneError) as caught:
        files_of_model(path)
    assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("words", OUTSIDE.values(), ids=OUTSIDE)
def test_what_leads_out_of_the_folder_is_refused(words: str, home: Path) -> None:
    assert STRAY in refusal(written(home, words))


def test_what_lies_in_the_folder_is_read_under_the_names_that_mujoco_asks_for(home: Path) -> None:
    (home / "deep" / "a.stl").write_bytes(b"mesh")
    (home / "b.png").write_bytes(b"picture")
    written(home, '<include file="../more.xml"/><texture file="./b.png"/>', "deep/b.xml")
    written(home, f'<mesh file="{home / "b.png"}"/>', "more.xml")
    path = written(home, '<compiler meshdir="deep"/><mesh file="a.stl"/><include file="deep/b.xml"/>')
    found = files_of_model(path)
    assert found.text == path.read_bytes() and found.outside == ""
    assert found.models == {
        "deep/b.xml": (home / "deep/b.xml").read_bytes(),
        "deep/../more.xml": (home / "more.xml").read_bytes(),
    }
    assert found.assets == {"deep/a.stl": b"mesh", "./b.png": b"picture", str(home / "b.png"): b"picture"}


def test_a_urdf_s_names_count_by_their_last_part_too_and_may_be_missing(home: Path) -> None:
    (home / "a.stl").write_bytes(b"mesh")
    words = '<mesh filename="package://hut/meshes/a.stl"/><mesh filename="package://hut/seen.dae"/>'
    assert files_of_model(written(home, words, "hut.urdf", "robot")).assets == {"a.stl": b"mesh"}
    assert STRAY in refusal(written(home, '<mesh filename="package://../secret"/>', "hut.urdf", "robot"))
    assert "names 'meshes/a.stl', which is not there" in refusal(written(home, '<mesh file="meshes/a.stl"/>'))
    assert files_of_model(written(home, '<compiler strippath="true"/><mesh file="meshes/a.stl"/>')).assets


def test_with_trust_files_may_lie_anywhere_and_later_those_alone(home: Path) -> None:
    path = written(home, '<include file="more.xml"/><mesh file="/etc/hostname"/>')
    found = files_of_model(path, trust=True)
    assert found.assets == {"../secret": b"secret", "/etc/hostname": Path("/etc/hostname").read_bytes()}
    assert files_of_model(path, trust=found.outside).assets == found.assets
    (home.parent / "secret").write_text("another")
    with pytest.raises(SceneError, match=r"outside its folder have changed since it was imported\. Import"):
        files_of_model(path, trust=found.outside)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "it is no XML"),
        ("<mujoco>", "it is no XML"),
        ("<mujoco>\0</mujoco>", "it is no XML"),
        ('<!DOCTYPE a [<!ENTITY b "&c;&c;"><!ENTITY c "laugh">]><mujoco>&b;</mujoco>', "declares a document type"),
        ('<!DOCTYPE a SYSTEM "/etc/passwd"><mujoco/>', "declares a document type"),
        ('<mujoco><include file="gone.xml"/></mujoco>', "names 'gone.xml', which is not there"),
        ('<mujoco><mesh file="circle"/></mujoco>', "'circle'"),
        ('<mujoco><mesh file="deep"/></mujoco>', "names 'deep', which is not there"),
        (f'<mujoco><mesh file="{"a" * 5000}"/></mujoco>', "'aaa"),
    ],
)
def test_what_is_no_model_is_one_line(text: str, says: str, home: Path) -> None:
    (home / "circle").symlink_to(home / "circle")
    (home / "world.xml").write_text(text)
    assert says in refusal(home / "world.xml")


def test_files_that_include_each_other_are_read_once(home: Path) -> None:
    path = written(home, '<include file="more.xml"/><include file="world.xml"/>')
    written(home, '<include file="world.xml"/><include file="./more.xml"/>', "more.xml")
    assert set(files_of_model(path).models) == {"more.xml", "world.xml", "./more.xml"}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_or_a_device_among_its_files_is_refused(home: Path) -> None:
    os.mkfifo(home / "silent.stl")
    assert "'silent.stl': it is a pipe, no regular file" in refusal(written(home, '<mesh file="silent.stl"/>'))
    (home / "endless").symlink_to("/dev/zero")
    path = written(home, '<mesh file="endless"/>')
    with pytest.raises(SceneError, match=r"'endless': it is a device, no regular file"):
        files_of_model(path, trust=True)


def test_there_are_limits_to_files_names_and_bytes(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for number in range(12):
        written(home, f'<include file="{number + 1}.xml"/>', f"{number}.xml")
    written(home, "", "12.xml")
    path = written(home, '<include file="0.xml"/><compiler meshdir="deep"/><mesh file="more.xml"/>')
    assert len(files_of_model(path).models) == 13
    for name, most, says in (
        ("MAX_FILES", 10, "names more than 10 files"),
        ("MAX_NAMES", 10, "names files in more than 10 ways"),
        ("MAX_BYTES", 300, "it is larger than"),
        ("MAX_TEXT_BYTES", 30, "one of its texts is larger than"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(mjcf_files, name, most)
            assert says in refusal(path)


def test_a_deep_text_is_read(home: Path) -> None:
    assert files_of_model(written(home, "<body>" * 100_000 + "</body>" * 100_000)).assets == {}
