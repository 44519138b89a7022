"""Scenes in an object store or on a web server are given where a path may stand."""

import shutil
import sys
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import gymnasium
import pytest

import clearway
from clearway.cli.main import main
from clearway.cli.run_names import longer
from clearway.envs.registration import ENV_ID, LIVE_ENV_ID
from clearway.errors import ClearwayError, EnvError, RunError
from clearway.learn.load import run_scenes
from clearway.learn.run_folder import RunFolder
from clearway.learn.run_record import record_of
from clearway.remote import cache
from clearway.remote.address import fetched_folder
from clearway.remote.records import with_origins
from clearway.scenes.digest import scene_digest
from clearway.scenes.scene_files import scene_files
from clearway.scenes.thor_v1 import write_scene
from clearway.views.stream import views_in
from helpers.made import corridor_scene
from helpers.made_views import write_made
from helpers.servers_of_files import files_of, web_server
from helpers.small_runs import small_learner, small_request


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
    told = capsys.readouterr().err
    assert told.startswith("error: s3://rooms/set/one.h5: cannot be opened as HDF5")
    assert str(fetched_folder()) not in told


@pytest.mark.parametrize("name", ["one", "my room"])
def test_files_are_told_of_by_their_addresses(name: str, s3: Callable[[str, bytes], None], files: Path) -> None:
    s3(f"set/{name}.h5", (files / "one.h5").read_bytes())
    (path,) = scene_files([Path(f"s3://rooms/set/{name}.h5")])
    assert with_origins(f"'{path}': damaged") == f"'s3://rooms/set/{name}.h5': damaged"


def test_a_run_s_scene_is_no_folder_elsewhere(s3: Callable[[str, bytes], None], files: Path) -> None:
    for path in files.iterdir():
        s3(f"set/{path.name}", path.read_bytes())
    record = record_of(small_request())
    elsewhere = replace(record, scenes=tuple(replace(scene, path="s3://rooms/set") for scene in record.scenes))
    with pytest.raises(RunError, match="s3://rooms/set: the run's scene is no scene file"):
        run_scenes(elsewhere)


def test_environments_take_addresses(s3: Callable[[str, bytes], None], files: Path) -> None:
    for path in files.iterdir():
        s3(f"set/{path.name}", path.read_bytes())
    with closing(gymnasium.make(ENV_ID, scenes="s3://rooms/set/one.h5", observations="pictures")) as env:
        env.reset(seed=0)
    with pytest.raises(EnvError, match=r"s3://rooms/set: a folder of 2 scenes\. Name one file"):
        gymnasium.make(ENV_ID, scenes="s3://rooms/set", observations="pictures")
    with pytest.raises(ClearwayError, match="one: there is no room to walk in"):
        gymnasium.make(LIVE_ENV_ID, room="s3://rooms/set/one.h5")


@pytest.mark.parametrize("word", ["{0}", "--scenes={0}"])
def test_commands_are_kept_and_told_without_secrets(word: str, monkeypatch: pytest.MonkeyPatch) -> None:
    words = ["train", word.format("https://user:pass@host/a.h5?signature=secret"), "--frames", "9"]
    monkeypatch.setattr(sys, "argv", ["clearway", *words])
    plain = ("clearway", "train", word.format("https://host/a.h5"), "--frames", "9")
    assert record_of(small_request()).command == plain
    assert longer(words, Path("r"), 9) == " ".join([*plain, "--out r --resume"])


def test_addresses_named_one_by_one_are_fetched_together(
    s3: Callable[[str, bytes], None], files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for path in files.iterdir():
        s3(f"set/{path.name}", path.read_bytes())
    together: list[int] = []
    fetched_each = cache.fetched_each
    monkeypatch.setattr(
        cache, "fetched_each", lambda *given, **more: together.append(len(given[0])) or fetched_each(*given, **more)
    )
    one, two, inside = "s3://rooms/set/one.h5", "s3://rooms/set/two.h5", corridor_scene(5, name="inside")
    loaded = clearway.load_scenes([two, files / "one.h5", inside, one, "s3://rooms/set", two])
    assert [scene.name for scene in loaded] == ["two", "one", "inside", "one", "one", "two", "two"]
    found = scene_files([Path(two), files, Path(one)])
    assert [path.stem for path in found] == ["two", "one", "two", "one"]
    assert together == [3, 2]


def test_a_folder_of_several_is_named_without_its_password(files: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CLEARWAY_CACHE", str(files.parent / "cache"))
    with web_server(files_of(files)) as address:
        secret = address.replace("://", "://me:secret@")
        for source in (secret, Path(secret)):
            with pytest.raises(ClearwayError, match=f"^{address}: 2 scenes"):
                clearway.load_scene(source)
