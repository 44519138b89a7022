"""Sets that do not fit into the cache: their files come when they are read, and go."""

import shutil
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import clearway
from clearway.errors import ClearwayError
from clearway.learn.load import run_scenes
from clearway.learn.run_folder import RunFolder
from clearway.remote import cache
from clearway.remote.address import RECORDS, fetched_folder
from clearway.remote.cache import LIMIT_VARIABLE, CacheWarning, fetched
from clearway.remote.passing import at_hand
from clearway.scenes.digest import scene_digest
from clearway.scenes.thor_v1 import write_scene
from clearway.views.stream import views_in
from helpers.made import corridor_scene
from helpers.made_views import write_made
from helpers.servers_of_files import files_of, web_server
from helpers.small_runs import small_learner

NAMES = tuple("abcdef")


def limit_to(files: float, folder: Path, monkeypatch: pytest.MonkeyPatch) -> float:
    """Set the limit to so many of the largest file; returns it, bytes."""
    most = files * max(path.stat().st_size for path in folder.iterdir())
    monkeypatch.setenv(LIMIT_VARIABLE, f"{most / 1e9:.12f}")
    return most


def kept_bytes() -> int:
    """Of all files in the cache."""
    return sum(path.stat().st_size for path in fetched_folder().rglob("*.h5"))


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


@pytest.mark.parametrize("files", [1, 2.5])
def test_views_come_in_the_same_order_within_the_limit(
    files: float, views: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    limit = limit_to(files, views, monkeypatch)
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


def test_an_agent_learns_from_a_set_that_does_not_fit(
    scenes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    limit = limit_to(2, scenes, monkeypatch)
    learner = small_learner(frames=80)
    clearway.train(scenes, algorithm=learner, out=tmp_path / "here")
    with pytest.warns(CacheWarning):
        clearway.train("s3://rooms/set", algorithm=learner, out=tmp_path / "there")
    here, there = (RunFolder(tmp_path / name) for name in ("here", "there"))
    ours, theirs = ([row["loss"] for row in folder.metrics()] for folder in (here, there))
    assert theirs == ours
    assert 0 < kept_bytes() <= limit
    record = there.read_record()
    assert [scene.path for scene in record.scenes] == [f"s3://rooms/set/{name}.h5" for name in NAMES]
    with pytest.warns(CacheWarning):
        again = run_scenes(record)
    assert [scene_digest(scene) for scene in again] == [scene.digest for scene in record.scenes]


def test_threads_share_what_comes(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    limit = limit_to(3, scenes, monkeypatch)
    here = {scene.name: np.asarray(scene.observations[:]) for scene in clearway.load_scenes(scenes)}  # type: ignore[index]
    with pytest.warns(CacheWarning):
        there = clearway.load_scenes("s3://rooms/set")

    def same(number: int) -> bool:
        scene = there[number % len(there)]
        return bool((scene.observations[:] == here[scene.name]).all())  # type: ignore[index]

    with ThreadPoolExecutor(3) as pool:
        assert all(pool.map(same, range(30)))
    assert kept_bytes() <= limit


def test_readers_wait_for_each_other(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where there is room for the file of one alone."""
    limit = limit_to(1.1, scenes, monkeypatch)
    with pytest.warns(CacheWarning):
        there = clearway.load_scenes("s3://rooms/set")
    with ThreadPoolExecutor(len(there)) as pool:
        seen = list(pool.map(lambda scene: scene.observations[:].sum(), there))
    assert seen == [scene.observations[:].sum() for scene in clearway.load_scenes(scenes)]  # type: ignore[index]
    assert kept_bytes() <= limit
    monkeypatch.setattr(cache, "WAIT_S", 0.2)
    with at_hand(there[0].observations.path), pytest.raises(ClearwayError, match="are to be kept here"):  # type: ignore[union-attr]
        there[1].observations[0]  # type: ignore[index]


def test_a_file_that_changed_there_is_refused(
    scenes: Path, s3: Callable[[str, bytes], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    limit_to(1, scenes, monkeypatch)
    with pytest.warns(CacheWarning):
        first, *_ = clearway.load_scenes("s3://rooms/set")
    s3("set/a.h5", (scenes / "b.h5").read_bytes())
    with pytest.raises(ClearwayError, match=r"^s3://rooms/set/a.h5: has changed since it was first read. Begin again$"):
        first.observations[0]  # type: ignore[index]


def test_a_file_that_is_gone_there_is_named(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from s3fs import S3FileSystem

    limit_to(1, scenes, monkeypatch)
    with pytest.warns(CacheWarning):
        first, *_ = clearway.load_scenes("s3://rooms/set")
    S3FileSystem().rm("rooms/set/a.h5")
    with pytest.raises(ClearwayError, match=r"^s3://rooms/set/a.h5: there is nothing there. Check the address$"):
        first.observations[0]  # type: ignore[index]


def test_an_emptied_cache_is_told_of(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    limit_to(1, scenes, monkeypatch)
    with pytest.warns(CacheWarning):
        first, *_ = clearway.load_scenes("s3://rooms/set")
    shutil.rmtree(fetched_folder() / RECORDS)
    with pytest.raises(ClearwayError, match=r"a.h5: has gone, and its record, too. Begin again with the address"):
        first.observations[0]  # type: ignore[index]


def test_a_file_larger_than_the_cache_is_refused(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    limit_to(0.5, scenes, monkeypatch)
    with (
        pytest.warns(CacheWarning),
        pytest.raises(ClearwayError, match=f"GB are to be kept here, .* Set {LIMIT_VARIABLE} to more"),
    ):
        clearway.load_scenes("s3://rooms/set")
    assert kept_bytes() == 0


def test_signed_addresses_are_not_fetched_twice(scenes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Their signatures are kept nowhere."""
    limit_to(1, scenes, monkeypatch)
    with web_server(files_of(scenes)) as address:
        signed = [f"{address}/{name}.h5?signature=secret" for name in NAMES]
        with pytest.raises(ClearwayError, match=f"GB are to be kept here, .* Set {LIMIT_VARIABLE} to more"):
            fetched(signed, (".h5",), may_pass=True)
    assert kept_bytes() == 0
