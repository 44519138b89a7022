"""What a MuJoCo model names lies in its folder, however it is written, or is refused before MuJoCo opens anything."""

from pathlib import Path

import pytest

from clearway.importers.mjcf_files import UnsafeModelError, check_files

OUTSIDE = {
    "up and out": '<mesh file="../secret"/>',
    "from the root": '<mesh file="/etc/passwd"/>',
    "in single quotes": "<mesh file = '../secret'/>",
    "over two lines": '<mesh file\n=\n"../secret"/>',
    "by backslashes": '<mesh file="..\\secret"/>',
    "by entities": '<mesh file="&#46;&#x2e;/secret"/>',
    "a side of a box": '<texture fileright="../secret"/>',
    "of a URDF": '<mesh filename="package://../secret"/>',
    "a folder": '<compiler meshdir=".."/><mesh file="secret"/>',
    "a folder and on": '<compiler assetdir="a/../.."/><mesh file="secret"/>',
    "behind a byte order mark": '\ufeff<mesh file="../secret"/>',
    "behind what looks like a comment": '<mesh name="<!--" file="../secret"/> <!-- -->',
    "by a link": '<mesh file="link"/>',
    "by an address": '<mesh file="http://example.org/a.stl"/>',
    "through an included file": '<include file="more.xml"/>',
    "through an included file's folder": '<include file="deep/inner.xml"/>',
    "a null byte": '<mesh file="a&#0;b\0"/>',
}


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A folder with a link out of it, included files that name others, and something secret beside it."""
    (tmp_path / "secret").write_text("secret")
    folder = tmp_path / "home"
    (folder / "deep").mkdir(parents=True)
    (folder / "link").symlink_to(tmp_path / "secret")
    (folder / "more.xml").write_text('<mujocoinclude><mesh file="../secret"/></mujocoinclude>')
    (folder / "deep" / "inner.xml").write_text('  \n<mujocoinclude><mesh file="../../secret"/></mujocoinclude>')
    return folder


@pytest.mark.parametrize("words", OUTSIDE.values(), ids=OUTSIDE)
def test_what_leads_out_of_the_folder_is_refused(words: str, home: Path) -> None:
    (home / "world.xml").write_text(words)
    with pytest.raises(UnsafeModelError, match=r"lies outside its folder|is no path"):
        check_files(home / "world.xml")


def test_what_lies_in_the_folder_may_be_named(home: Path) -> None:
    (home / "deep" / "a.stl").write_bytes(b"solid file='../../../secret'")  # a mesh is no text of XML
    (home / "deep" / "b.xml").write_text('<include file="../deep/b.xml"/><texture file="gone.png" profile="/etc"/>')
    (home / "world.xml").write_text('<compiler meshdir="deep"/><mesh file="a.stl"/><include file="deep/b.xml"/>')
    with pytest.raises(UnsafeModelError):  # from the model's own folder, ../deep leads out
        check_files(home / "world.xml")
    (home / "deep" / "b.xml").write_text('<include file="b.xml"/><texture file="gone.png" profile="/etc"/>')
    check_files(home / "world.xml")


def test_with_trust_files_may_lie_anywhere(home: Path) -> None:
    (home / "world.xml").write_text('<include file="more.xml"/><mesh file="/etc/hostname"/>')
    check_files(home / "world.xml", trust=True)
