"""Sets that do not fit into the cache: their files come when they are read, and go."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import clearway
from clearway.cli.main import main
from clearway.errors import ClearwayError
from clearway.learn.load import run_scenes
from clearway.learn.run_folder import RunFolder
from clearway.remote import cache, passing
from clearway.remote.address import fetched_folder
from clearway.remote.cache import AHEAD, LIMIT_VARIABLE, CacheWarning, fetched
from clearway.remote.records import RECORDS, origin
from clearway.remote.store import Store
from clearway.remote.together import AT_ONCE
from clearway.scenes.digest import scene_digest
from clearway.scenes.thor_v1 import write_scene
from clearway.views.stream import views_in
from helpers.made import corridor_scene
from helpers.made_views import write_made
from helpers.servers_of_files import Dateless, files_of, web_server
from helpers.small_runs import small_learner

NAMES = tuple("abcdef")
SET = "s3://rooms/set"


def limit_to(files: float, folder: Path, monkeypatch: pytest.MonkeyPatch) -> float:
    """Set the limit to so many of the largest file; returns it, bytes."""
    most = files * max(path.stat().st_size for path in folder.iterdir())
    monkeypatch.setenv(LIMIT_VARIABLE, f"{most / 1e9:.12f}")
    return most


def kept_bytes() -> int:
    """Of all files in the cache."""
    return sum(path.stat().st_size for path in fetched_folder().rglob("*.h5"))


def passing_scenes() -> list[clearway.Scene]:
    """The scenes of the store, which do not fit."""
    with pytest.warns(CacheWarning, match=f"{SET}: .* do not fit .* Set {LIMIT_VARIABLE} to more"):
        return clearway.load_scenes(SET)


def looked_at(scene: clearway.Scene) -> np.ndarray:
    assert scene.observations is not None
    return scene.observations[:]


@pytest.fixture
def scenes(s3: Callable[[str, bytes], None], tmp_path: Path) -> Path:
    """A folder of six scene files, which also lie in the store."""
    for length, name in enumerate(NAMES, 4):
        path = tmp_path / f"files/{name}.h5"
        write_scene(corridor_scene(length, name=name), path)
        s3(f"set/{name}.h5", path.read_bytes())
    return tmp_path / "files"


@pytest.fixture
def views(s3: Callable[[str, bytes], None], tmp_path: Path) -> Path:
    """A folder of six shards, which also lie in the store."""
    for seed, name in enumerate(NAMES):
        s3(f"views/{name}.h5", write_made(tmp_path / "views", name, seed=seed).read_bytes())
    return tmp_path / "views"


@pytest.mark.slow
@pytest.mark.parametrize("files", [1, 2.5, 4 / AHEAD])
def test_views_come_in_the_same_order_within_the_limit(
    files: float, views: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    limit = limit_to(files, views, monkeypatch)
    if files > len(NAMES):  # all of them fit, and pass all the same
        monkeypatch.setattr("clearway.remote.cache._stay", lambda *_: False)
    here = views_in([views])
    with pytest.warns(CacheWarning, match=f"s3://rooms/views: .* do not fit .* Set {LIMIT_VARIABLE} to more"):
        there = views_in([Path("s3://rooms/views")])
    count = 0
    for epoch in (0, 1):
        for ours, theirs in zip(here.batches(4, epoch=epoch), there.batches(4, epoch=epoch), strict=True):
            assert all((theirs.seen[name] == ours.seen[name]).all() for name in ("rgb", "depth"))
            assert (theirs.table.to_array() == ours.table.to_array()).all()
            assert 0 < kept_bytes() <= limit
            count += 1
    assert count == 2 * here.batch_count(4)


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)], ids=["one worker", "several workers"])
def test_an_agent_learns_from_a_set_that_does_not_fit(
    workers: int, scenes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    limit = limit_to(1, scenes, monkeypatch)
    learner = small_learner(frames=240)
    clearway.train(scenes, algorithm=learner, workers=workers, out=tmp_path / "here")
    with pytest.warns(CacheWarning):
        clearway.train(SET, algorithm=learner, workers=workers, out=tmp_path / "there")
    here, there = (RunFolder(tmp_path / name) for name in ("here", "there"))
    ours, theirs = ([(row["loss"], row["steps"]) for row in folder.metrics()] for folder in (here, there))
    assert theirs == ours and len(ours) == 3
    assert 0 < kept_bytes() <= limit
    record = there.read_record()
    assert [scene.path for scene in record.scenes] == [f"{SET}/{name}.h5" for name in NAMES]
    with pytest.warns(CacheWarning):
        again = run_scenes(record)
    assert [scene_digest(scene) for scene in again] == [scene.digest for scene in record.scenes]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_workers_on_ray_learn_from_a_set_that_does_not_fit(
    scenes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from helpers.on_ray import cluster_here  # where Ray is not installed, this test alone is skipped

    limit = limit_to(1, scenes, monkeypatch)
    learner = small_learner(frames=240)
    clearway.train(scenes, algorithm=learner, workers=2, out=tmp_path / "here")
    run: dict[str, Any] = {"algorithm": learner, "workers": 2, "ray": "local", "out": tmp_path / "there"}
    with cluster_here(2), pytest.warns(CacheWarning):  # workers find an empty cache, as on another machine
        clearway.train(SET, on_begin=lambda _: shutil.rmtree(fetched_folder()), **run)
    folders = (RunFolder(tmp_path / name) for name in ("here", "there"))
    ours, theirs = ([(row["loss"], row["steps"]) for row in folder.metrics()] for folder in folders)
    assert theirs == ours and len(ours) == 3
    assert 0 < kept_bytes() <= limit


@pytest.mark.slow
def test_threads_read_side_by_side(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where there is room for one file, and every one of them is wanted by several at once."""
    limit = limit_to(1, scenes, monkeypatch)
    here = {scene.name: looked_at(scene) for scene in clearway.load_scenes(scenes)}
    there = passing_scenes()

    def same(number: int) -> bool:
        scene = there[number // 3 % len(there)]
        return bool((looked_at(scene) == here[scene.name]).all())

    with ThreadPoolExecutor(6) as pool:
        assert all(pool.map(same, range(36)))
    assert kept_bytes() <= limit


@pytest.mark.slow
def test_processes_read_side_by_side(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    limit = limit_to(1.5, scenes, monkeypatch)
    program = (
        "import warnings, clearway; warnings.simplefilter('ignore'); "
        f"print(sum(int(scene.observations[:].sum()) for _ in range(3) for scene in clearway.load_scenes('{SET}')))"
    )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    started = [
        subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True, env=environment)
        for _ in range(2)
    ]
    expected = 3 * sum(int(looked_at(scene).sum()) for scene in clearway.load_scenes(scenes))
    assert [int(process.communicate(timeout=200)[0]) for process in started] == [expected] * 2
    assert kept_bytes() <= limit


def test_a_file_that_several_want_comes_once(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    limit_to(3, scenes, monkeypatch)
    (first, *_), came, download = passing_scenes(), [], Store.download
    shutil.rmtree(first.observations.path.parent, ignore_errors=True)  # type: ignore[union-attr]
    monkeypatch.setattr(Store, "download", lambda *given: (came.append(given[1].name), download(*given)))
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(looked_at, [first] * 8))
    assert came == ["a.h5"]


@pytest.mark.parametrize("beside", [False, True], ids=["alone", "beside files of this machine"])
def test_those_that_come_next_are_fetched_together(beside: bool, scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    limit_to(3 / AHEAD, scenes, monkeypatch)
    monkeypatch.setattr(cache, "_stay", lambda *_: False)
    with pytest.warns(CacheWarning):
        paths = fetched([SET], (".h5",), may_pass=True)
    expected = [len(group) for group in cache.groups(paths)]
    groups: list[int] = []
    fetch_again = cache.fetch_again
    monkeypatch.setattr(cache, "fetch_again", lambda some: groups.append(len(some)) or fetch_again(some))
    here = [scenes / "a.h5"] if beside else []
    given = [*here, *paths]
    for path, wanted in zip(passing.in_turn(given), given, strict=True):
        assert path == wanted and path.exists()
    assert groups == expected and 1 < len(expected) < len(NAMES)


def test_groups_end_at_the_room_and_at_the_number_of_downloads(monkeypatch: pytest.MonkeyPatch) -> None:
    places = [fetched_folder() / f"{number:032x}-100/a.h5" for number in range(2 * AT_ONCE + 1)]
    monkeypatch.setenv(LIMIT_VARIABLE, "1")
    assert [len(group) for group in cache.groups(places)] == [AT_ONCE, AT_ONCE, 1]
    monkeypatch.setenv(LIMIT_VARIABLE, f"{300 / AHEAD / 1e9:.12f}")
    assert [len(group) for group in cache.groups(places[:7])] == [3, 3, 1]
    here = [Path("here.h5")]
    assert [len(group) for group in cache.groups([*here, *places[:4], *here])] == [4, 2]


def test_what_was_read_last_goes_last(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Reading counts as use, not only fetching."""
    limit_to(20, scenes, monkeypatch)
    monkeypatch.setattr(cache, "_stay", lambda *_: False)
    with pytest.warns(CacheWarning):
        first, second, third, *_ = fetched([f"{SET}/{name}.h5" for name in "abc"], (".h5",), may_pass=True)
    passing.bring([first, second])
    for age_s, path in ((200, first), (100, second)):
        used_s = time.time() - age_s
        os.utime(path.parent, (used_s, used_s))
    with passing.name_of_present(first):
        pass
    limit_to(2.1, scenes, monkeypatch)
    passing.bring([third])
    assert (first.exists(), second.exists(), third.exists()) == (True, False, True)


def test_another_process_may_be_faster(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    download = Store.download

    def late(store: Store, file: Any, path: Path, *more: Any) -> None:
        download(store, file, path, *more)
        theirs = fetched_folder() / path.parent.name
        if not theirs.exists():
            shutil.copytree(path.parent, theirs)

    monkeypatch.setattr(Store, "download", late)
    (path,) = fetched([f"{SET}/a.h5"], (".h5",))
    assert path.read_bytes() == (scenes / "a.h5").read_bytes()


def test_a_place_that_cannot_be_taken_is_told_of(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where something else is in the way: the tolerance for another process is for a file that has come."""
    download = Store.download

    def late(store: Store, file: Any, path: Path, *more: Any) -> None:
        download(store, file, path, *more)
        theirs = fetched_folder() / path.parent.name
        theirs.mkdir()
        (theirs / "other").write_text("")

    monkeypatch.setattr(Store, "download", late)
    with pytest.raises(ClearwayError, match="cannot be written to"):
        fetched([f"{SET}/a.h5"], (".h5",))


def test_who_has_opened_a_file_reads_on_when_it_goes(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    limit_to(1, scenes, monkeypatch)
    first, second, *_ = passing_scenes()
    with passing.name_of_present(first.observations.path) as name:  # type: ignore[union-attr]
        looked_at(second)
        assert not first.observations.path.exists()  # type: ignore[union-attr]
        assert name.read_bytes() == (scenes / "a.h5").read_bytes()


def test_a_file_that_goes_while_it_is_opened_is_opened_again(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    limit_to(1, scenes, monkeypatch)
    *_, last = passing_scenes()
    path, expected, opened, goes = last.observations.path, looked_at(last), h5py.File, [True]  # type: ignore[union-attr]

    def late(name: Path, mode: str) -> h5py.File:
        if goes:
            goes.clear()
            shutil.rmtree(path.parent)
        return opened(name, mode)

    monkeypatch.setattr(h5py, "File", late)
    assert (looked_at(last) == expected).all() and not goes


def test_a_damaged_copy_comes_again(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where nothing has to go, so that it lies there when it is read."""
    monkeypatch.setattr("clearway.remote.cache._stay", lambda *_: False)
    *_, last = passing_scenes()
    path = last.observations.path  # type: ignore[union-attr]
    path.write_bytes(path.read_bytes()[:-100])
    assert (looked_at(passing_scenes()[-1]) == looked_at(clearway.load_scenes(scenes)[-1])).all()


def test_a_file_that_is_replaced_while_it_comes_is_refused(
    scenes: Path, s3: Callable[[str, bytes], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    download = Store.download

    def late(*given: Any) -> None:
        s3("set/a.h5", bytes((scenes / "a.h5").stat().st_size))
        download(*given)

    monkeypatch.setattr(Store, "download", late)
    with pytest.raises(ClearwayError, match=r"^s3://rooms/set/a.h5: has changed while it was fetched. Begin again$"):
        fetched([f"{SET}/a.h5"], (".h5",))
    assert kept_bytes() == 0


def test_what_comes_counts_for_others(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A set that stays, and is fetched while a file of one that passes is under way, makes no more of the cache."""
    limit_to(1.2, scenes, monkeypatch)
    (first, *_), download = passing_scenes(), Store.download

    def late(*given: Any) -> None:
        monkeypatch.setattr(Store, "download", download)
        with pytest.raises(ClearwayError, match="are to be kept here"):
            fetched([f"{SET}/f.h5"], (".h5",))
        download(*given)

    monkeypatch.setattr(Store, "download", late)
    assert looked_at(first).size
    fetched([f"{SET}/f.h5"], (".h5",))


def test_a_whole_set_leaves_room_for_those_that_pass(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = sum(path.stat().st_size for path in scenes.iterdir())
    monkeypatch.setenv(LIMIT_VARIABLE, f"{whole * 1.01 / 1e9:.12f}")
    passing_scenes()
    monkeypatch.setenv(LIMIT_VARIABLE, f"{whole * 1.01 / (1 - AHEAD) / 1e9:.12f}")
    assert len(clearway.load_scenes(SET)) == len(NAMES)
    assert kept_bytes() == whole


def test_a_file_that_changed_there_is_refused(
    scenes: Path, s3: Callable[[str, bytes], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    limit_to(1, scenes, monkeypatch)
    first, *_ = passing_scenes()
    s3("set/a.h5", (scenes / "b.h5").read_bytes())
    with pytest.raises(ClearwayError, match=r"^s3://rooms/set/a.h5: has changed since it was first read. Begin again$"):
        looked_at(first)


def test_a_copy_that_was_written_to_is_refused(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    limit_to(1, scenes, monkeypatch)
    *_, last = passing_scenes()
    path = last.observations.path  # type: ignore[union-attr]
    path.write_bytes(path.read_bytes())
    with pytest.raises(ClearwayError, match="has changed since the scene was read"):
        looked_at(last)


def test_a_file_that_is_gone_there_is_named(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from s3fs import S3FileSystem

    limit_to(1, scenes, monkeypatch)
    first, *_ = passing_scenes()
    S3FileSystem().rm("rooms/set/a.h5")
    with pytest.raises(ClearwayError, match=r"^s3://rooms/set/a.h5: there is nothing there. Check the address$"):
        looked_at(first)


def test_an_emptied_cache_is_told_of_and_heals(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    limit_to(1, scenes, monkeypatch)
    first, *_ = passing_scenes()
    record = fetched_folder() / RECORDS / first.observations.path.parent.name  # type: ignore[union-attr]
    record.write_text("")
    with pytest.raises(ClearwayError, match=r"a.h5: has gone, and its record, too. Begin again with the address"):
        looked_at(first)
    passing_scenes()
    assert looked_at(first).size
    assert origin(first.observations.path) == f"{SET}/a.h5"  # type: ignore[union-attr]


def test_a_file_larger_than_the_cache_is_refused(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    limit_to(0.5, scenes, monkeypatch)
    with (
        pytest.warns(CacheWarning),
        pytest.raises(ClearwayError, match=f"GB are to be kept here, .* Set {LIMIT_VARIABLE} to more"),
    ):
        clearway.load_scenes(SET)
    assert kept_bytes() == 0


@pytest.mark.parametrize("query", ["?signature=secret", ""], ids=["signed", "no version"])
def test_what_cannot_be_known_again_does_not_pass(query: str, scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Signatures are kept nowhere, and a file without a version may be another one when it comes again."""
    limit_to(1, scenes, monkeypatch)
    handler = files_of(scenes, Dateless) if not query else files_of(scenes)
    with web_server(handler) as address, pytest.raises(ClearwayError, match="GB are to be kept here"):
        fetched([f"{address}/{name}.h5{query}" for name in NAMES], (".h5",), may_pass=True)
    assert kept_bytes() == 0


def test_only_the_cache_s_own_files_come_and_go(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder with a link into the cache, and a file that somebody put there, are left as they are."""
    limit_to(1, scenes, monkeypatch)
    *_, last = passing_scenes()
    path = last.observations.path  # type: ignore[union-attr]
    link = scenes.parent / "rooms-2" / "f.h5"
    link.parent.mkdir()
    link.symlink_to(path)
    own = fetched_folder() / "own" / "a.h5"
    own.parent.mkdir()
    shutil.copy(scenes / "a.h5", own)
    assert (looked_at(clearway.load_scene(link)) == looked_at(last)).all()
    assert looked_at(clearway.load_scene(own)).size
    monkeypatch.chdir(path.parent)
    assert looked_at(clearway.load_scene(path.name)).size
    assert link.is_symlink() and own.exists()
    alike = scenes.parent / path.parent.name / "f.h5"
    alike.parent.mkdir()
    shutil.copy(path, alike)
    scene = clearway.load_scene(alike)
    alike.unlink()
    with pytest.raises(ClearwayError, match="has changed since the scene was read"):
        looked_at(scene)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "kind"),
    [
        (("inspect", "s3://rooms/views"), "views"),
        (("inspect", f"{SET}/f.h5"), "scenes"),
        (("export", f"{SET}/f.h5", "--out", "f.h5"), "scenes"),
    ],
    ids=["inspect views", "inspect", "export"],
)
def test_commands_read_what_passes(
    words: tuple[str, ...],
    kind: str,
    request: pytest.FixtureRequest,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    limit_to(1, request.getfixturevalue(kind), monkeypatch)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["scenes", *words])
    told = capsys.readouterr()
    assert ended.value.code == 0, told.err
    assert "do not fit into a cache of" in told.err
    assert "export" not in words or (tmp_path / "f.h5").exists()
