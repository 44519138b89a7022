"""Scenes in an object store or on a web server are given where a path may stand."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

import clearway
from clearway.cli.main import main
from clearway.learn.load import run_scenes
from clearway.learn.run_folder import RunFolder
from clearway.remote.address import fetched_folder
from clearway.scenes.digest import scene_digest
from clearway.scenes.thor_v1 import write_scene
from clearway.views.stream import views_in
from helpers.made import corridor_scene
from helpers.made_views import write_made
from helpers.servers_of_files import files_of, web_server
from helpers.small_runs import small_learner


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A folder of two scene files."""
    for name in ("one", "two"):
        write_scene(corridor_scene(5 if name == "one" else 6, name=name), tmp_path / f"files/{name}.h5")
    return tmp_path / "files"


def test_scenes_elsewhere_are_those_here(
    s3: Callable[[str, bytes], None], files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for path in files.iterdir():
        s3(f"set/{path.name}", path.read_bytes())
    here = [scene_digest(scene) for scene in clearway.load_scenes(files)]
    assert [scene_digest(scene) for scene in clearway.load_scenes("s3://rooms/set")] == here
    with web_server(files_of(files)) as address:
        assert [scene_digest(scene) for scene in clearway.load_scenes([address])] == here
    with pytest.raises(SystemExit) as ended:
        main(["scenes", "inspect", "s3://rooms/set/one.h5"])
    assert ended.value.code == 0
    assert "states 20 cells 5" in " ".join(capsys.readouterr().out.split())


def test_views_elsewhere_are_those_here(s3: Callable[[str, bytes], None], tmp_path: Path) -> None:
    for name in ("one", "two"):
        s3(f"views/{name}.h5", write_made(tmp_path / "views", name).read_bytes())
    here, there = (views_in([Path(where)]) for where in (tmp_path / "views", "s3://rooms/views"))
    assert there.rooms == here.rooms == ("one", "two")
    for ours, theirs in zip(here.batches(4), there.batches(4), strict=True):
        assert all((theirs.seen[name] == ours.seen[name]).all() for name in ("rgb", "depth"))


def test_a_run_finds_its_scenes_again(s3: Callable[[str, bytes], None], files: Path, tmp_path: Path) -> None:
    for path in files.iterdir():
        s3(f"set/{path.name}", path.read_bytes())
    clearway.train("s3://rooms/set", algorithm=small_learner(frames=80), out=tmp_path / "run")
    record = RunFolder(tmp_path / "run").read_record()
    assert [scene.path for scene in record.scenes] == ["s3://rooms/set/one.h5", "s3://rooms/set/two.h5"]
    assert "s3://rooms/set/one.h5" in (tmp_path / "run/run.yaml").read_text()
    shutil.rmtree(fetched_folder())
    assert [scene.name for scene in run_scenes(record)] == ["one", "two"]


def test_a_damaged_scene_elsewhere_is_refused(
    s3: Callable[[str, bytes], None], files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    s3("set/one.h5", (files / "one.h5").read_bytes()[:1000])
    with pytest.raises(SystemExit) as ended:
        main(["scenes", "inspect", "s3://rooms/set/one.h5"])
    assert ended.value.code == 2
    assert "cannot be opened as HDF5" in capsys.readouterr().err
