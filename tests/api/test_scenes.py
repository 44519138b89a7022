from dataclasses import replace

import numpy as np
import pytest

import clearway
from clearway.api.scenes import scenes_and_files
from clearway.errors import ArgumentError
from clearway.scenes.thor_v1 import write_scene
from helpers.made import corridor_scene, grid_scene, with_depth


@pytest.fixture
def folder(tmp_path):
    write_scene(grid_scene(1), tmp_path / "grid.h5")
    write_scene(corridor_scene(feature_count=32), tmp_path / "corridor.h5")
    return tmp_path


def test_scenes_come_from_files_folders_and_memory(folder) -> None:
    made = corridor_scene(name="made")
    assert clearway.load_scene(str(folder / "grid.h5")).name == "grid"
    assert clearway.load_scene(folder / "grid.h5").name == "grid"
    assert clearway.load_scene(made) is made
    assert [scene.name for scene in clearway.load_scenes(folder)] == ["corridor", "grid"]
    assert [scene.name for scene in clearway.load_scenes([folder / "grid.h5", made])] == ["grid", "made"]


def test_files_named_one_by_one_are_read_by_all_processes(folder, monkeypatch) -> None:
    given = []

    def noted(function, things, before):
        given.append(list(things))
        return map(function, things)

    monkeypatch.setattr("clearway.api.scenes.of_each", noted)
    made, files = corridor_scene(name="made"), [folder / "grid.h5", folder / "corridor.h5"]
    pairs = scenes_and_files([files[0], made, files[1]], features_in_file=True)
    assert given == [files]
    assert [(scene.name, file) for scene, file in pairs] == [("grid", files[0]), ("made", None), ("corridor", files[1])]
    assert all("components" in vars(scene) for scene, file in pairs if file is not None)  # found by who reads


def test_a_file_system_path_of_any_kind_will_do(folder) -> None:
    class Place:
        def __fspath__(self) -> str:
            return str(folder / "grid.h5")

    assert clearway.load_scene(Place()).name == "grid"


@pytest.mark.parametrize(
    ("source", "part"),
    [
        (3, "expected a scene, a scene file, a folder of them, or several"),
        ([3], "expected a path"),
        (b"grid.h5", "expected a path"),
        (None, "Give one of these"),
        ([], "none given"),
    ],
)
def test_what_is_no_scene_is_refused(source, part) -> None:
    with pytest.raises(ArgumentError, match=part) as caught:
        clearway.load_scenes(source)
    assert isinstance(caught.value, TypeError | ValueError)
    assert "\n" not in str(caught.value)


def test_a_missing_file_and_one_too_many_are_refused(folder) -> None:
    with pytest.raises(clearway.ClearwayError, match="no such file"):
        clearway.load_scene(folder / "cellar.h5")
    with pytest.raises(ArgumentError, match=r"2 scenes\. Name one"):
        clearway.load_scene(folder)


def test_build_room_renders_encodes_and_writes(tmp_path, monkeypatch) -> None:
    from clearway.rooms import library

    calls = []

    def stand_in(name, seed, *, sensors, workers, progress):
        calls.append((name, seed, sensors, workers, progress))
        return with_depth(grid_scene(seed, name=name, picture_size=(30, 40)))

    monkeypatch.setattr(library, "cached_room_scene", stand_in)
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    out = tmp_path / "rooms/bathroom.h5"
    scene = clearway.build_room("bathroom", np.int64(2), out=str(out))
    assert calls == [("bathroom", 2, ("rgb",), None, False)]
    assert scene.encoder_name == "clearway"
    assert np.array_equal(clearway.load_scene(out).features, scene.features)
    seen = clearway.build_room("bathroom", sensors=["rgb", "depth"], encoder="depth-grid")
    assert calls[1:] == [("bathroom", 0, ("rgb", "depth"), None, False)]
    assert seen.features.shape == (seen.state_count, 108)
    assert seen.seen_by("depth")[:].shape == (seen.state_count, 30, 40)


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ({"name": "cellar"}, "expected one of 'bathroom'"),
        ({"name": "bathroom", "seed": -1}, "seed=-1: expected a whole number from 0"),
        ({"name": "bathroom", "seed": 1.5}, r"seed=1\.5: expected a whole number"),
        ({"name": "bathroom", "out": "room.txt"}, r"ends in \.h5 or \.hdf5"),
        ({"name": "bathroom", "encoder_seed": -3}, "encoder_seed=-3"),
        ({"name": "bathroom", "sensors": "rgb"}, r"'rgb' is a text\. Give names"),
        ({"name": "bathroom", "sensors": ["sonar"]}, r"there is no 'sonar'\. Choose among rgb, depth"),
        ({"name": "bathroom", "encoder": "depth-grid"}, "depth-grid sees depth, and it is not rendered"),
    ],
)
def test_build_room_refuses_before_it_builds(arguments, part) -> None:
    with pytest.raises(clearway.ClearwayError, match=part):
        clearway.build_room(**arguments)


class Brightness:
    identity = "brightness-1"
    feature_count = 2

    def encode(self, pictures):
        return np.stack([pictures.mean((1, 2, 3)), pictures.std((1, 2, 3))], axis=1)


def test_an_encoder_of_one_s_own_encodes_and_its_features_can_be_trained_on(tmp_path) -> None:
    (scene,) = clearway.encode_scenes(grid_scene(1), Brightness())
    np.testing.assert_allclose(scene.features[:, 0], scene.observations.mean((1, 2, 3)), rtol=1e-6)
    assert (scene.encoder_name, scene.features.dtype) == ("Brightness", np.float32)
    assert scene.encoder.identity != clearway.encode_scenes(grid_scene(1), Other())[0].encoder.identity
    write_scene(scene, tmp_path / "grid.h5")
    run = clearway.train(tmp_path / "grid.h5", [5], frames=400, envs=10, rollout_steps=8, width=16, out=tmp_path / "r")
    with pytest.raises(clearway.ClearwayError, match="Brightness: a program of its own made the features"):
        clearway.Navigator(run.folder)


class Nearest:
    identity = "nearest-1"
    feature_count = 1
    sensor = "depth"

    def encode(self, depth_m):
        return depth_m.min((1, 2))[:, None]


def test_an_encoder_of_one_s_own_may_take_depth() -> None:
    (scene,) = clearway.encode_scenes(with_depth(grid_scene(1)), Nearest())
    np.testing.assert_array_equal(scene.features[:, 0], scene.seen_by("depth")[:].min((1, 2)))
    assert scene.encoder.settings["sensor"] == "depth"
    with pytest.raises(clearway.ClearwayError, match="grid: has rgb, but no depth"):
        clearway.encode_scenes(grid_scene(1), Nearest())


class Sonic(Nearest):
    identity = "sonic-1"
    sensor = "sonar"


@pytest.mark.parametrize(
    ("encoder", "part"),
    [
        (Nearest(), r"Nearest sees depth, and it is not rendered\. Add --sensors rgb depth"),
        (Sonic(), r"Sonic sees sonar, and it is not rendered\. Use one that sees rgb or depth"),
    ],
)
def test_an_encoder_of_one_s_own_whose_sensor_is_not_rendered_is_refused_before(monkeypatch, encoder, part) -> None:
    from clearway.rooms import library

    monkeypatch.setattr(library, "cached_room_scene", lambda *_, **__: pytest.fail("a room was built"))
    with pytest.raises(clearway.ClearwayError, match=part):
        clearway.build_room("bathroom", encoder=encoder)


class Other(Brightness):
    identity = "brightness-2"


def test_an_encoder_of_one_s_own_without_a_part_is_refused_before_a_room_is_built() -> None:
    class Empty:
        pass

    for call in (clearway.encode_scenes, clearway.build_room):
        with pytest.raises(clearway.ClearwayError, match=r"encoder Empty: its identity is None, .*Give it one"):
            call(grid_scene(1) if call is clearway.encode_scenes else "bathroom", encoder=Empty())
    with pytest.raises(ArgumentError, match="workers=2: an encoder of your own runs in this process"):
        clearway.encode_scenes(grid_scene(1), Brightness(), workers=2)
    with pytest.raises(clearway.ClearwayError, match="has no pictures to encode"):
        clearway.encode_scenes(replace(grid_scene(1), observations=None), Brightness())


def test_an_encoder_of_one_s_own_may_see_depth() -> None:
    class Nearest:
        identity, feature_count, sensor = "nearest-1", 1, "depth"

        def encode(self, depth_m):
            return depth_m.reshape(len(depth_m), -1).min(1, keepdims=True)

    scene = with_depth(grid_scene(1))
    (seen,) = clearway.encode_scenes(scene, Nearest())
    depth_m = scene.seen_by("depth")[np.arange(scene.state_count)]
    assert np.array_equal(np.asarray(seen.features)[:, 0], depth_m.reshape(scene.state_count, -1).min(1))
    with pytest.raises(clearway.ClearwayError, match="has rgb, but no depth"):
        clearway.encode_scenes(grid_scene(1), Nearest())
    with pytest.raises(clearway.ClearwayError, match="sees depth, and it is not rendered"):
        clearway.build_room("bathroom", encoder="depth-grid")
    with pytest.raises(clearway.ClearwayError, match="Choose among rgb, depth"):
        clearway.build_room("bathroom", sensors=["rgb", "sonar"])
