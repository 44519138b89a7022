"""What is there is kept, what is missing is made, what is wrong is told. One room is rendered."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import h5py
import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.generation import files
from clearway.generation.files import Seen, generate_scenes, notes_of, request_of, scene_path
from clearway.generation.plans import generated_plan
from clearway.generation.request import Request
from clearway.live.live_room import live_room
from clearway.perception.eyes import write_eyes
from clearway.scenes.floor_plans import GENERATED
from clearway.scenes.plan_scenes import floor_plan_scene, plan_of
from clearway.scenes.scene import EncoderRecord, Provenance, Scene
from clearway.scenes.sensors import Readings, depth
from clearway.scenes.thor_v1 import read_scene, write_scene
from helpers.crashing import crashes_once
from helpers.made_files import Made
from helpers.small_eyes import small_eyes

REQUESTS = [Request("room", "train", 0, number) for number in (3, 7)]
SEEN = Seen(size_px=(24, 32))
RECORD = EncoderRecord("random-resnet50", "abc", {"seed": 0})


def stand_in(request: Request, seen: Seen = SEEN, record: EncoderRecord | None = None) -> Scene:
    """The scene of a request with grey pictures."""
    scene = floor_plan_scene(generated_plan(request), 4)
    pictures = np.full((scene.state_count, *seen.size_px, 3), 99, np.uint8)
    made_by = Provenance(GENERATED, seed=request.seed, notes=notes_of(request))
    features = None if record is None else scene.features
    return replace(scene, observations=pictures, made_by=made_by, encoder=record, features=features)


@pytest.fixture
def made(monkeypatch) -> Made:
    """Names of what is made; workers are stood in for by this process, and rooms by grey ones."""
    names = Made()

    def make(work, request: Request) -> None:
        write_scene(stand_in(request), scene_path(request, work.set_up().folder))

    workers_for = names.workers_for(lambda request: request.name, make)
    monkeypatch.setattr(files, "workers_for", workers_for)
    monkeypatch.setattr(files, "check_mujoco", lambda: None)
    return names


make = partial(generate_scenes, seen=SEEN, encoder="none")


def test_what_is_there_is_not_made_again(made, tmp_path) -> None:
    told: list[int] = []
    assert make(REQUESTS[:1], tmp_path / "rooms") == [tmp_path / "rooms/room-train-000003-bathroom.h5"]
    first = (tmp_path / "rooms/room-train-000003-bathroom.h5").stat()
    paths = make(REQUESTS, tmp_path / "rooms", done=told.append)
    assert [path.name for path in paths] == ["room-train-000007-bathroom.h5"]
    assert made == ["room-train-000003-bathroom", "room-train-000007-bathroom"] and told == [1, 2]
    assert (tmp_path / "rooms/room-train-000003-bathroom.h5").stat().st_mtime_ns == first.st_mtime_ns
    assert make(REQUESTS, tmp_path / "rooms") == [] and len(made) == 2


def test_an_interrupted_generation_goes_on(made, tmp_path) -> None:
    made.failing.add("room-train-000007-bathroom")
    with pytest.raises(SceneError, match="No space left"):
        make(REQUESTS, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["room-train-000003-bathroom.h5"]
    made.failing.clear()
    make(REQUESTS, tmp_path)
    assert made == ["room-train-000003-bathroom", "room-train-000007-bathroom"]


@pytest.mark.parametrize(
    ("kept", "said"),
    [
        (lambda path: path.write_bytes(b"no scene"), "is not an HDF5 file. Remove it, and the same command makes it"),
        (lambda path: path.write_bytes(path.read_bytes()[:-2000]), "Remove it, and the same command makes it again"),
        (lambda path: write_scene(another(generator=0), path), "made by version 0 of the generator.* has version 2"),
        (lambda path: write_scene(another(source="floor_plan"), path), "made from floor_plan"),
        (lambda path: write_scene(another(split="test"), path), "is no room-train-000003-bathroom of seed 0"),
        (lambda path: write_scene(another(seed=4), path), "is no room-train-000003-bathroom of seed 0"),
        (
            lambda path: write_scene(stand_in(REQUESTS[0], Seen(size_px=(30, 40))), path),
            r"has rgb \(30 x 40\), asked for rgb \(24 x 32\)",
        ),
        (lambda path: write_scene(with_depth(), path), r"has rgb \(24 x 32\), depth \(24 x 32\), asked for rgb"),
        (
            lambda path: write_scene(stand_in(REQUESTS[0], record=RECORD), path),
            r"has features of random-resnet50 \(abc\), asked for none",
        ),
    ],
)
def test_a_file_that_is_not_what_is_asked_for_is_told(made, tmp_path, kept, said) -> None:
    path = tmp_path / "room-train-000003-bathroom.h5"
    write_scene(stand_in(REQUESTS[0]), path)
    kept(path)
    before = path.read_bytes()
    with pytest.raises(SceneError, match=said) as refused:
        make(REQUESTS, tmp_path)
    assert str(refused.value).startswith(str(path))
    assert made == [] and path.read_bytes() == before


@pytest.mark.parametrize("dataset", ["observation", "sensors/depth", "resnet_feature"])
@pytest.mark.parametrize("share", [0.0, 0.5, 0.999])
def test_one_changed_byte_in_a_file_that_is_there_is_told(made, tmp_path, dataset, share) -> None:
    path = scene_path(REQUESTS[0], tmp_path)
    scene = replace(with_depth(), encoder=RECORD, features=floor_plan_scene(generated_plan(REQUESTS[0]), 4).features)
    write_scene(scene, path)
    seen = Seen(("rgb", "depth"), SEEN.size_px)
    assert generate_scenes(REQUESTS[:1], tmp_path, seen, "random-resnet50") == []
    with h5py.File(path) as file:
        kept = file[dataset].id
        chunk = kept.get_chunk_info(int(share * kept.get_num_chunks()))
    content = bytearray(path.read_bytes())
    content[chunk.byte_offset + int(share * (chunk.size - 1))] ^= 1
    path.write_bytes(content)
    with pytest.raises(SceneError, match="Remove it, and the same command makes it again") as refused:
        generate_scenes(REQUESTS[:1], tmp_path, seen, "random-resnet50")
    assert str(refused.value).startswith(f"{path}") and dataset in str(refused.value)
    assert made == [] and path.read_bytes() == content


def another(source: str = GENERATED, seed: int = 0, **notes: object) -> Scene:
    changed = {**notes_of(REQUESTS[0]), **notes}
    return replace(stand_in(REQUESTS[0]), made_by=Provenance(source, seed=seed, notes=changed))


def with_depth() -> Scene:
    scene = stand_in(REQUESTS[0])
    return replace(scene, further=(Readings(depth(24, 32), np.ones((scene.state_count, 24, 32), np.uint16)),))


def test_features_go_on_with_the_encoder_of_the_files_that_are_there(tmp_path) -> None:
    there = {REQUESTS[0]: stand_in(REQUESTS[0], record=RECORD)}
    assert files._record_of(there, tmp_path, "random-resnet50", 0) is RECORD
    eyes = replace(RECORD, name="clearway")
    for asked in ("auto", "clearway"):
        assert files._record_of({REQUESTS[0]: stand_in(REQUESTS[0], record=eyes)}, tmp_path, asked, 0) is eyes
    folder = tmp_path / "own"
    write_eyes(folder, small_eyes().eval(), {})
    own = replace(RECORD, name="own")
    assert files._record_of({REQUESTS[0]: stand_in(REQUESTS[0], record=own)}, tmp_path, str(folder), 0) is own
    with pytest.raises(SceneError, match="asked for auto"):
        files._record_of(there, tmp_path, "auto", 0)
    assert files._record_of({}, tmp_path, "auto", 0) is None
    with pytest.raises(SceneError, match="has no features, asked for auto"):
        files._record_of({REQUESTS[0]: stand_in(REQUESTS[0])}, tmp_path, "auto", 0)
    with pytest.raises(SceneError, match="asked for random-resnet50"):
        files._record_of(there, tmp_path, "random-resnet50", 1)
    both = {**there, REQUESTS[1]: stand_in(REQUESTS[1], record=replace(RECORD, identity="def"))}
    with pytest.raises(SceneError, match=r"000007-bathroom.h5: has .*\(def\), asked for those of the other files"):
        files._record_of(both, tmp_path, "random-resnet50", 0)


def test_a_scene_gives_its_request_back() -> None:
    request = Request("flat", "train", 2, 5)
    assert request_of(stand_in(request).made_by) == request
    assert request_of(floor_plan_scene(generated_plan(request), 4).made_by) is None


@pytest.mark.slow
def test_a_room_is_begun_anew_where_its_process_crashes(monkeypatch, tmp_path) -> None:
    monkeypatch.setattr(files, "_make", crashes_once)
    monkeypatch.setattr(files, "check_mujoco", lambda: None)
    assert make(REQUESTS[:1], tmp_path, workers=1) == [scene_path(REQUESTS[0], tmp_path)]
    assert (tmp_path / "begun").exists()


@pytest.mark.slow
def test_a_room_is_rendered_in_a_worker_of_its_own(tmp_path) -> None:
    request = min((Request("room", "train", 0, n) for n in range(3, 40, 4)), key=lambda r: len(generated_plan(r).cells))
    seen = Seen(("rgb", "depth"), (24, 32))
    (path,) = generate_scenes([request], tmp_path, seen, "none", workers=1)
    scene = read_scene(path)
    plan, drawn = plan_of(scene), generated_plan(request)
    assert np.array_equal(plan.walls, drawn.walls) and plan.areas == drawn.areas and plan.name == drawn.name
    assert request_of(scene.made_by) == request and {"clearway", "mujoco"} <= set(scene.made_by.versions)
    assert scene.observations[:].shape[1:] == (24, 32, 3) and scene.observations[:].std() > 10
    assert scene.seen_by("depth")[0].shape == (24, 32)
    np.testing.assert_array_equal(scene.locations_m[::4], generated_plan(request).cells * 0.5)
    assert scene.features is None and int(scene.components.max()) == 0
    assert live_room(scene).scene.state_count == scene.state_count  # it can be walked in
    assert generate_scenes([request], tmp_path, seen, "none", workers=1) == []
