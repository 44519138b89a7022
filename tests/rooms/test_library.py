from __future__ import annotations

import os
import random
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clearway.rooms import library
from clearway.rooms.library import cached_plan_scene, cached_room_scene, plan_path, scene_path
from clearway.scenes.floor_plans import Area, FloorPlan
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import read_scene
from helpers.made import grid_scene

SLOW_BUILDER = """
import sys; sys.path[:] = {path!r}
import time
from dataclasses import replace
from pathlib import Path
from clearway.rooms.library import cached_room_scene
from helpers.made import grid_scene

class SlowPictures:
    def __init__(self, pictures):
        self.pictures, self.shape = pictures, pictures.shape

    def __getitem__(self, index):
        note("written")
        return self.pictures[index]

def note(line):
    with Path({log!r}).open("a") as log:
        log.write(line + "\\n")
    if line == {slow_when!r}:
        time.sleep({seconds})

def build(name, seed, *, sensors, workers, ray, progress):
    note("built")
    scene = grid_scene(seed)
    return replace(scene, observations=SlowPictures(scene.observations))

print(cached_room_scene("kitchen", 7, build=build).state_count, flush=True)
"""


@pytest.fixture
def cache(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path))
    return tmp_path / "scenes"


class CountingBuilder:
    """Builds a made-up scene and counts how often."""

    def __init__(self) -> None:
        self.built = 0

    def __call__(
        self, name: str, seed: int, *, sensors: Sequence[str], workers: int | None, ray: str | None, progress: bool
    ) -> Scene:
        self.built += 1
        return grid_scene(seed)


def start_builder(log: Path, slow_when: str, seconds: float) -> subprocess.Popen:
    path = [folder or os.getcwd() for folder in sys.path]
    script = SLOW_BUILDER.format(path=path, log=str(log), slow_when=slow_when, seconds=seconds)
    return subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)


def files_in(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir() if not file.name.endswith(".lock"))


def test_a_scene_is_built_once_and_comes_back_whole(cache):
    build = CountingBuilder()
    first = cached_room_scene("kitchen", 7, build=build)
    again = cached_room_scene("kitchen", 7, build=build)
    assert build.built == 1
    made = grid_scene(7)
    for scene in (first, again):
        assert scene.name == "kitchen-7"
        np.testing.assert_array_equal(scene.graph, made.graph)
        np.testing.assert_array_equal(scene.observations[:], made.observations[:])
        np.testing.assert_array_equal(scene.top_view.image, made.top_view.image)
        assert scene.made_by == made.made_by


def test_another_room_seed_version_or_source_is_another_scene(cache, monkeypatch, tmp_path):
    build = CountingBuilder()
    paths = {scene_path("kitchen", 0), scene_path("kitchen", 1), scene_path("bathroom", 0)}
    paths.add(scene_path("kitchen", 0, ("rgb", "depth")))
    cached_room_scene("kitchen", 0, build=build)
    monkeypatch.setattr(library, "shaping_versions", lambda: {"mujoco": "99"})
    paths.add(scene_path("kitchen", 0))
    cached_room_scene("kitchen", 0, build=build)
    package = tmp_path / "rooms"
    (package / "furniture").mkdir(parents=True)
    (package / "__init__.py").touch()
    (package / "furniture" / "sofa.py").write_text("colour = 'red'\n")
    monkeypatch.setattr(library.rooms, "__file__", str(package / "__init__.py"))
    paths.add(scene_path("kitchen", 0))
    (package / "furniture" / "sofa.py").write_text("colour = 'blue'\n")
    paths.add(scene_path("kitchen", 0))
    for module in (library.building, library.grid, library.floor_plans, library.sensing):
        changed = tmp_path / f"{module.__name__.rpartition('.')[2]}.py"
        changed.write_text("pass\n")
        monkeypatch.setattr(module, "__file__", str(changed))
        paths.add(scene_path("kitchen", 0))
    assert len(paths) == 11
    assert all(path.parent == cache for path in paths)
    assert build.built == 2


@pytest.mark.slow
def test_three_processes_that_ask_for_one_scene_build_it_once(cache, tmp_path):
    log = tmp_path / "log"
    builders = [start_builder(log, "built", seconds=1.0) for _ in range(3)]
    answers = [builder.communicate(timeout=200)[0].strip() for builder in builders]
    assert answers == [str(grid_scene(7).state_count)] * 3
    assert log.read_text().split().count("built") == 1


@pytest.mark.parametrize("killed_when", ["built", "written"])
def test_a_killed_builder_leaves_no_scene_and_blocks_nobody(cache, tmp_path, killed_when):
    log = tmp_path / "log"
    builder = start_builder(log, killed_when, seconds=600)
    deadline = time.monotonic() + 60
    while not (log.exists() and killed_when in log.read_text()):
        assert time.monotonic() < deadline
        time.sleep(0.02)
    builder.kill()
    builder.communicate()
    assert not scene_path("kitchen", 7).exists()
    assert cached_room_scene("kitchen", 7, build=CountingBuilder()).state_count == grid_scene(7).state_count
    assert files_in(cache) == [scene_path("kitchen", 7).name]


@pytest.mark.parametrize("kills", [3, pytest.param(20, marks=pytest.mark.slow)])
def test_builders_killed_at_random_moments_leave_nothing_and_the_next_builds(cache, tmp_path, kills):
    log, moments, whole = tmp_path / "log", random.Random(kills), scene_path("kitchen", 7)
    for _ in range(kills):
        whole.unlink(missing_ok=True)
        log.unlink(missing_ok=True)
        builders = [start_builder(log, "none", seconds=0) for _ in range(2)]
        deadline = time.monotonic() + 60
        while not (log.exists() and "built" in log.read_text()):
            assert time.monotonic() < deadline
            time.sleep(0.002)
        time.sleep(moments.uniform(0, 0.06))
        for builder in builders:
            builder.kill()
            builder.communicate()
        if whole.exists():
            assert read_scene(whole).observations[:].shape == grid_scene(7).observations.shape
        assert cached_room_scene("kitchen", 7, build=CountingBuilder()).state_count == grid_scene(7).state_count
    whole.unlink()
    cached_room_scene("kitchen", 7, build=CountingBuilder())
    assert files_in(cache) == [whole.name]


def test_a_damaged_file_is_built_again(cache):
    build = CountingBuilder()
    cached_room_scene("kitchen", 7, build=build)
    path = scene_path("kitchen", 7)
    path.write_bytes(path.read_bytes()[:500])
    assert cached_room_scene("kitchen", 7, build=build).state_count == grid_scene(7).state_count
    assert build.built == 2


def test_names_cannot_lead_out_of_the_cache(cache):
    assert scene_path("../../etc/kitchen", 0).parent == cache


def test_the_room_of_a_floor_plan_is_built_once(cache, monkeypatch):
    built = []

    def build(plan, seed, *, sensors, size_px, workers, ray, progress):
        built.append((plan.name, seed))
        return replace(grid_scene(seed), name=plan.name)

    monkeypatch.setattr(library, "build_floor_plan", build)
    plan = FloorPlan("hall", np.array([[0, 0], [1, 0]]))
    first, again = cached_plan_scene(plan, 2), cached_plan_scene(plan, 2)
    assert built == [("hall", 2)] and first.name == again.name == "hall"
    assert np.array_equal(first.observations[:], again.observations[:])
    assert [path.name for path in cache.glob("*.h5")] == [plan_path(plan, 2).name]
    cached_plan_scene(plan, 2, sensors=("rgb", "depth"))
    assert len(built) == 2  # without depth is another file
    cached_plan_scene(plan, 2, size_px=(24, 32))
    assert len(built) == 3  # and so is one of smaller pictures


def test_another_plan_has_another_file(cache):
    plan = FloorPlan("hall", np.array([[0, 0], [1, 0]]))
    others = (
        replace(plan, name="den"),
        replace(plan, cells=np.array([[0, 0], [0, 1]])),
        replace(plan, cells=np.array([[1, 0], [0, 0]])),
        replace(plan, cell_size_m=0.5),
        replace(plan, blocked_edges=np.array([[[0, 0], [1, 0]]])),
        replace(plan, walls=np.array([[0, 1]])),
        replace(plan, doors=np.array([[0, 0]])),
        replace(plan, areas=(Area("kitchen", (0, 0), (1, 0)),)),
    )
    paths = {plan_path(plan, 0), plan_path(plan, 1), *(plan_path(other, 0) for other in others)}
    assert len(paths) == 10
