"""What is there is kept, what is missing is made, what is wrong is told. One room is built and rendered."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.generation.plans import generated_plan
from clearway.generation.request import Request
from clearway.live.words import GEOMETRY
from clearway.scenes.plan_scenes import floor_plan_scene
from clearway.scenes.thor_v1 import write_scene
from clearway.views import files
from clearway.views.files import take_missing
from clearway.views.settings import ViewSettings
from clearway.views.shard import read_shard
from helpers.imported import imported_by
from helpers.made import corridor_scene
from helpers.made_files import Made
from helpers.made_views import SETTINGS, made_views, write_made


@pytest.fixture
def scenes(tmp_path: Path) -> list[Path]:
    """Two scene files."""
    paths = [tmp_path / "scenes" / f"{name}.h5" for name in ("one", "two")]
    for path in paths:
        write_scene(replace(corridor_scene(), name=path.stem), path)
    return paths


@pytest.fixture
def made(monkeypatch) -> Made:
    """Names of what is made; this process stands in for workers, and made-up pictures for rendered ones."""
    names = Made()
    workers_for = names.workers_for(lambda path: path.stem, lambda work, path: work.do(work.set_up(), path))
    monkeypatch.setattr(files, "workers_for", workers_for)
    monkeypatch.setattr(files, "check_mujoco", lambda: None)
    monkeypatch.setattr(files, "room_views", lambda scene, settings: made_views(settings))
    return names


def test_what_is_there_is_not_made_again(made, scenes, tmp_path) -> None:
    out, told = tmp_path / "views", []
    assert take_missing(scenes[:1], out, SETTINGS) == [out / "one.h5"]
    first = (out / "one.h5").stat().st_mtime_ns
    assert take_missing(scenes, out, SETTINGS, done=told.append) == [out / "two.h5"]
    assert made == ["one", "two"] and told == [1, 2]
    assert (out / "one.h5").stat().st_mtime_ns == first
    assert take_missing(scenes, out, SETTINGS) == [] and len(made) == 2
    assert read_shard(out / "two.h5").room == "two"


def test_an_interrupted_command_goes_on(made, scenes, tmp_path) -> None:
    made.failing.add("two")
    with pytest.raises(SceneError, match="No space left"):
        take_missing(scenes, tmp_path / "views", SETTINGS)
    assert [path.name for path in (tmp_path / "views").iterdir()] == ["one.h5"]
    made.failing.clear()
    assert take_missing(scenes, tmp_path / "views", SETTINGS) == [tmp_path / "views/two.h5"]


@pytest.mark.parametrize(
    ("kept", "said"),
    [
        (lambda path: path.write_bytes(b"nothing"), "is not an HDF5 file. Remove it, and the same command makes it"),
        (lambda path: path.write_bytes(path.read_bytes()[:-900]), "Remove it, and the same command makes it again"),
        (lambda path: write_made(path.parent, "one", replace(SETTINGS, takes=3)), "has takes 3 instead of 2"),
        (
            lambda path: write_made(path.parent, "one", replace(SETTINGS, seed=1)),
            "has seed 1 instead of 0. Remove it",
        ),
        (lambda path: write_scene(corridor_scene(), path), "holds no views. Give another folder with --out"),
    ],
)
def test_a_file_that_is_not_what_is_asked_for_is_told(made, scenes, tmp_path, kept, said) -> None:
    take_missing(scenes[:1], tmp_path / "views", SETTINGS)
    path = tmp_path / "views/one.h5"
    kept(path)
    before = path.read_bytes()
    with pytest.raises(SceneError, match=said) as refused:
        take_missing(scenes, tmp_path / "views", SETTINGS)
    assert str(refused.value).startswith(str(path))
    assert made == ["one"] and path.read_bytes() == before


def test_a_shard_of_another_room_of_that_name_is_told(made, scenes, tmp_path) -> None:
    take_missing(scenes[:1], tmp_path / "views", SETTINGS)
    write_scene(replace(corridor_scene(7), name="one"), scenes[0])
    with pytest.raises(SceneError, match=r"views/one\.h5: shows another room than .*scenes/one\.h5"):
        take_missing(scenes[:1], tmp_path / "views", SETTINGS)


def test_scenes_are_never_written_over_nor_mixed_up(made, scenes, tmp_path) -> None:
    with pytest.raises(SceneError, match="its views would be written over it"):
        take_missing(scenes, scenes[0].parent, SETTINGS)
    with pytest.raises(SceneError, match="has the same name as"):
        take_missing([scenes[0], tmp_path / "other/one.h5"], tmp_path / "views", SETTINGS)
    assert made == []


@pytest.mark.slow
def test_workers_load_no_torch() -> None:
    assert "torch" not in imported_by(
        "import clearway.views.files, clearway.views.grid, clearway.api.views, clearway.views.stream"
    )


@pytest.mark.slow
def test_a_scene_that_is_no_room_is_told_by_its_worker(scenes, tmp_path) -> None:
    with pytest.raises(SceneError, match="there is no room to walk in: the scene comes from test"):
        take_missing(scenes[:1], tmp_path / "views", SETTINGS, workers=1)
    assert not list((tmp_path / "views").iterdir())


@pytest.mark.slow
def test_a_room_is_built_and_seen_in_a_worker_of_its_own(tmp_path) -> None:
    numbers = range(3, 40, 4)  # bathrooms
    plan = min((generated_plan(Request("room", "train", 0, n)) for n in numbers), key=lambda one: len(one.cells))
    scene = floor_plan_scene(plan, 8)
    write_scene(scene, tmp_path / f"{scene.name}.h5")
    settings = ViewSettings(
        poses=8, takes=2, perturbations=replace(GEOMETRY, light=0.5), sensors=("rgb", "depth"), size_px=(24, 32)
    )
    (path,) = take_missing([tmp_path / f"{scene.name}.h5"], tmp_path / "views", settings, workers=1)
    shard = read_shard(path)
    rgb, depth = shard.seen("rgb", slice(None)), shard.seen("depth", slice(None))
    assert rgb.shape == (16, 24, 32, 3) and depth.shape == (16, 24, 32)
    assert rgb.std() > 10 and 100 < np.median(depth) < 5000  # millimetres
    table = shard.table
    assert len(np.unique(table.height_m)) == 16
    assert len(np.unique(table.heading_deg)) > 13  # where furniture stands on a pose, its takes look along its heading
    nearest_m = depth[:, 8:16, 12:20].min(axis=(1, 2)) / 1000
    assert (table.free_m[:, 0] < depth[:, 12].max(axis=1) / 1000).mean() > 0.5
    assert np.corrcoef(nearest_m, table.free_m[:, 0])[0, 1] > 0.3
    places_m = np.column_stack([table.x_m, table.z_m])
    apart_m = np.abs(scene.locations_m[None] - places_m[:, None]).max(axis=2).min(axis=1)
    assert (apart_m <= 0.25 + 1e-9).all()  # in the coordinates of the scene
    kept = path.stat().st_mtime_ns
    assert take_missing([tmp_path / f"{scene.name}.h5"], tmp_path / "views", settings) == []
    assert path.stat().st_mtime_ns == kept
