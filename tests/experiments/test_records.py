"""Records of a reproduction come to the report of the reproduction itself."""

import io
import json
import random
import runpy
import shutil
import tarfile
from pathlib import Path

import pytest

from clearway.errors import SceneError
from clearway.experiments.reproduce import ReproduceRequest, gather, reproduce
from clearway.experiments.request_file import REQUEST_FILE
from clearway.scenes.thor_v1 import write_scene
from helpers.small_setting import small_rooms

pytestmark = pytest.mark.slow

RECORDS = runpy.run_path(str(Path(__file__).parents[2] / "benchmarks" / "records.py"))
ENCODER = "random-resnet50"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A reproduction of a small room in the bathroom's place."""
    out = tmp_path_factory.mktemp("reproduction")
    path = out / "scenes" / ENCODER / "bathroom" / "bathroom.h5"
    path.parent.mkdir(parents=True)
    write_scene(small_rooms()[0], path)
    request = ReproduceRequest(
        ["memory"], out, "smoke", rooms=["bathroom"], encoder=ENCODER, learners=["default"], frames=800, seeds=1
    )
    reproduce(request)
    return out


def test_a_record_comes_to_the_same_sections(folder: Path, tmp_path: Path) -> None:
    record, again = tmp_path / "record.tar.xz", tmp_path / "again"
    RECORDS["pack"](folder, record)
    RECORDS["unpack"]([record], again)
    assert not list(again.rglob("*.safetensors"))
    assert gather(again).sections == gather(folder).sections
    assert not gather(again).sections[0].missing


def test_what_a_record_says_decides(folder: Path, tmp_path: Path) -> None:
    record, again = tmp_path / "record.tar.xz", tmp_path / "again"
    RECORDS["pack"](folder, record)
    RECORDS["unpack"]([record], again)
    next((again / "runs").glob("bc-*/trials/*.json")).unlink()
    assert gather(again).sections[0].missing


def test_scenes_and_runs_may_be_two_records(folder: Path, tmp_path: Path) -> None:
    records = [tmp_path / f"{part}.tar.xz" for part in ("scenes", "runs")]
    for record in records:
        RECORDS["pack"](folder, record, [record.name.partition(".")[0]])
    RECORDS["unpack"](records[1:], tmp_path / "runs")
    with pytest.raises(
        SceneError, match=r"bathroom\.h5: this room of the reproduction is not there\. Unpack the record"
    ):
        gather(tmp_path / "runs")
    assert not (tmp_path / "runs" / "scenes").exists()  # nothing was built
    RECORDS["unpack"](records, tmp_path / "again")
    RECORDS["pack"](folder, tmp_path / "whole.tar.xz")
    RECORDS["unpack"]([tmp_path / "whole.tar.xz"], tmp_path / "other")
    files = [
        {path.relative_to(top): path.read_bytes() for path in top.rglob("*") if path.is_file()}
        for top in (tmp_path / "again", tmp_path / "other")
    ]
    assert files[0] == files[1] and gather(tmp_path / "again").sections == gather(folder).sections


def test_scenes_that_were_given_are_in_the_record(tmp_path: Path) -> None:
    given = tmp_path / "rooms"
    for scene in small_rooms():
        given.mkdir(exist_ok=True)
        write_scene(scene, given / f"{scene.name}.h5")
    folder, record, again = tmp_path / "out", tmp_path / "record.tar.xz", tmp_path / "again"
    dumps = sorted(given.iterdir())
    reproduce(
        ReproduceRequest(["memory"], folder, "paper", dumps=dumps, learners=["default"], frames=800, seeds=1, workers=1)
    )
    expected = gather(folder).sections
    RECORDS["pack"](folder, record)
    shutil.rmtree(given)
    RECORDS["unpack"]([record], again)
    assert sorted(path.name for path in (again / "scenes/given").iterdir()) == ["bathroom.h5", "kitchen.h5"]
    assert gather(again).sections == expected and not expected[0].missing
    assert str(tmp_path) not in (again / REQUEST_FILE).read_text()
    RECORDS["pack"](again, tmp_path / "second.tar.xz")
    RECORDS["unpack"]([tmp_path / "second.tar.xz"], tmp_path / "third")
    assert gather(tmp_path / "third").sections == expected


@pytest.mark.parametrize(
    ("place", "kept"),
    [
        ("/out", b'["out/x.h5", "out", "/tmp/out/", "/outer", "https://x.org//y"]'),
        ("/tmp/out", b'["/out/x.h5", "/out", "out/", "/outer", "https://x.org//y"]'),
    ],
)
def test_where_a_folder_lay_is_not_told_and_all_else_is(place: str, kept: bytes) -> None:
    told = b'["/out/x.h5", "/out", "/tmp/out/", "/outer", "https://x.org//y"]'
    assert RECORDS["_by_its_name"](told, [Path(place)]) == kept


def test_where_a_folder_with_other_letters_lay_is_not_told_either() -> None:
    for told in (json.dumps("/srv/jos\u00e9/run"), json.dumps("/srv/jos\u00e9/run", ensure_ascii=False)):
        assert RECORDS["_by_its_name"](told.encode(), [Path("/srv/jos\u00e9/run")]) == b'"run"'


def test_the_same_folder_gives_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "first.tar.xz", tmp_path / "second.tar.xz"
    RECORDS["pack"](folder, first)
    RECORDS["pack"](folder, second)
    assert first.read_bytes() == second.read_bytes()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("unpack", "nowhere.tar.xz", "new"), "nowhere.tar.xz'. Name records"),
        (("unpack", "no.tar.xz", "new"), "Name records of docs/records, and a new folder"),
        (
            ("unpack", "good.tar.xz", "no.tar.xz", "new"),
            r"error: no\.tar\.xz: not an lzma file, expected a \.tar\.xz file that records\.py pack wrote\. Name",
        ),
        (("unpack", "good.tar.xz", "cut.tar.xz", "new"), r"error: cut\.tar\.xz: .*, expected a \.tar\.xz file"),
        (("unpack", "bent.tar.xz", "new"), r"error: bent\.tar\.xz: .*, expected a \.tar\.xz file"),
        (("pack", ".", "new.tar.xz"), "no reproduction here"),
        (("pack", "twice", "new.tar.xz"), "twice: two of its scenes' files have one name"),
        (("pack", "empty", "new.tar.xz"), "empty: holds no scenes and no runs to pack"),
        (("pack", "damaged", "new.tar.xz"), "Name a folder that clearway reproduce made"),
        (("unpack", "no.tar.xz", "."), "is there already"),
    ],
)
def test_what_is_no_record_is_refused_and_leaves_nothing(
    words: tuple[str, ...], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "no.tar.xz").write_text("no archive")
    with tarfile.open(tmp_path / "good.tar.xz", "w:xz") as archive:
        member = tarfile.TarInfo("a.json")
        member.size = 5_000
        archive.addfile(member, io.BytesIO(random.Random(0).randbytes(member.size)))
    good = (tmp_path / "good.tar.xz").read_bytes()
    (tmp_path / "cut.tar.xz").write_bytes(good[:3_000])
    (tmp_path / "bent.tar.xz").write_bytes(good[:2_000] + bytes(100) + good[2_100:])
    for name, content in (("twice", {"dumps": ["a/hall.h5", "b/hall.h5"]}), ("empty", {"dumps": []}), ("damaged", {})):
        (tmp_path / name).mkdir()
        (tmp_path / name / REQUEST_FILE).write_text(json.dumps(content))
    before = sorted(tmp_path.rglob("*"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["records.py", *words])
    with pytest.raises(SystemExit, match=said) as refusal:
        RECORDS["main"]()
    assert str(refusal.value).startswith("error: ") and str(refusal.value).count("\n") == 0
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("name", ["/etc/passed", "../outside", "runs/../../outside", "link"])
def test_a_record_writes_nothing_outside_its_folder(name: str, tmp_path: Path) -> None:
    record = tmp_path / "bad.tar.xz"
    with tarfile.open(record, "w:xz") as archive:
        member = tarfile.TarInfo(name)
        if name == "link":
            member.type, member.linkname = tarfile.SYMTYPE, "/etc/passwd"
        archive.addfile(member, io.BytesIO())
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(tarfile.TarError, match="is no file of a record"):
        RECORDS["unpack"]([record], tmp_path / "new")
    assert sorted(tmp_path.rglob("*")) == before
