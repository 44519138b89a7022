"""Generated rooms in the user's cache: made once, whoever asks."""

from __future__ import annotations

import numpy as np
import pytest

import clearway as door
from clearway.errors import ClearwayError
from clearway.generation import cached
from clearway.generation.cached import cached_requests, room_of_seed
from clearway.generation.files import Seen, scene_path
from clearway.generation.plans import generated_plan
from clearway.generation.request import MAX_SEED, Request
from clearway.scenes.plan_scenes import floor_plan_scene
from clearway.scenes.thor_v1 import write_scene


@pytest.fixture
def made(tmp_path, monkeypatch) -> list[str]:
    """A cache of its own, and the names of the rooms that were made."""
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    names: list[str] = []

    def generate(requests, folder, seen, encoder, **rest):
        for request in requests:
            if not (path := scene_path(request, folder)).exists():
                scene = floor_plan_scene(generated_plan(request), 24)
                object.__setattr__(scene, "observations", np.zeros((scene.state_count, *seen.size_px, 3), np.uint8))
                write_scene(scene, path)
                names.append(request.name)

    monkeypatch.setattr(cached, "generate_scenes", generate)
    return names


def test_nothing_is_made_twice(made):
    first = door.generate("room", 1, split="validation", encoder="none", size=(16, 24))
    both = door.generate("room", 2, split="validation", encoder="none", size=(16, 24))
    assert first == both[:1] and all(path.exists() for path in both)
    assert made == ["room-validation-000000-kitchen", "room-validation-000001-living_room"]


def test_what_looks_otherwise_lies_elsewhere(made):
    requests = [Request("room", "validation", 0, 0)]
    looks = (Seen(), Seen(size_px=(16, 24)), Seen(sensors=("rgb", "depth")))
    folders = {cached_requests(requests, seen)[0].parent for seen in looks}
    folders |= {cached_requests(requests, encoder="clearway")[0].parent}
    assert len(folders) == 4


def test_a_seed_is_a_room_of_validation_and_the_uses_take_turns(made):
    names = [room_of_seed(seed).name for seed in (5, 6, 5)]
    assert names[0] == names[2] == "room-validation-000001-living_room-5" and names[1].endswith("bedroom-6")
    assert len(made) == 2


@pytest.mark.parametrize("seed", [-1, MAX_SEED + 1])
def test_a_seed_out_of_range(made, seed):
    with pytest.raises(ClearwayError, match=f"seed {seed}: expected 0 to"):
        room_of_seed(seed)
    assert made == []


@pytest.mark.slow
def test_a_real_room_of_a_seed(tmp_path, monkeypatch):
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    request = Request.of_seed(2)
    (path,) = cached_requests([request], Seen(size_px=(16, 24)), workers=1)
    assert path.name == "room-validation-000002-bedroom-2.h5" and path.is_relative_to(tmp_path / "cache")
    before = path.stat().st_mtime_ns
    monkeypatch.setattr("clearway.generation.files.build_request", None)
    assert cached_requests([request], Seen(size_px=(16, 24)), workers=1) == [path]
    assert path.stat().st_mtime_ns == before
