"""Records of a reproduction come to the report of the reproduction itself."""

import runpy
from pathlib import Path

import pytest

from clearway.experiments.reproduce import ReproduceRequest, gather, reproduce
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
    RECORDS["unpack"](records, tmp_path / "again")
    RECORDS["pack"](folder, tmp_path / "whole.tar.xz")
    RECORDS["unpack"]([tmp_path / "whole.tar.xz"], tmp_path / "other")
    files = [
        {path.relative_to(top): path.read_bytes() for path in top.rglob("*") if path.is_file()}
        for top in (tmp_path / "again", tmp_path / "other")
    ]
    assert files[0] == files[1] and gather(tmp_path / "again").sections == gather(folder).sections


def test_the_same_folder_gives_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "first.tar.xz", tmp_path / "second.tar.xz"
    RECORDS["pack"](folder, first)
    RECORDS["pack"](folder, second)
    assert first.read_bytes() == second.read_bytes()
