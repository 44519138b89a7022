import os
import pickle
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.scenes import hdf5
from clearway.scenes.file_pictures import FilePictures
from clearway.scenes.graph import distances
from clearway.scenes.thor_v1 import read_scene, step_length_m, write_scene
from clearway.scenes.validate import SceneWarning
from helpers.dumps import full_scene, published_dump
from helpers.made import corridor_scene, graph_of_cells


def test_round_trip_keeps_everything(tmp_path: Path) -> None:
    scene = full_scene()
    write_scene(scene, tmp_path / "attic.h5")
    again = read_scene(tmp_path / "attic.h5")
    assert again.name == "attic"
    for part in ("features", "locations_m", "headings_deg", "graph"):
        kept, made = getattr(again, part), getattr(scene, part)
        assert kept.dtype == made.dtype, part
        assert np.array_equal(kept, made), part
    assert np.array_equal(again.observations[:], scene.observations)
    assert again.made_by == scene.made_by
    assert again.cell_size_m == scene.cell_size_m
    assert (again.encoder.name, again.encoder.identity) == (scene.encoder.name, scene.encoder.identity)
    assert again.encoder.settings == scene.encoder.settings
    assert again.encoder.arrays.keys() == scene.encoder.arrays.keys()
    for name, values in scene.encoder.arrays.items():
        assert np.array_equal(again.encoder.arrays[name], values)
        assert again.encoder.arrays[name].dtype == values.dtype
    assert np.array_equal(again.top_view.image, scene.top_view.image)
    assert again.top_view.x_max_m == scene.top_view.x_max_m


def test_round_trip_of_a_scene_that_is_not_encoded(tmp_path: Path) -> None:
    scene = replace(corridor_scene(3), features=None, encoder=None, top_view=None)
    write_scene(scene, tmp_path / "bare.h5")
    again = read_scene(tmp_path / "bare.h5", name="other")
    assert again.name == "other"
    assert again.features is again.encoder is again.top_view is None


def test_published_loaders_read_what_we_write(tmp_path: Path) -> None:
    scene = full_scene()
    write_scene(scene, tmp_path / "scene.h5")
    with h5py.File(tmp_path / "scene.h5", "r") as file:  # as the published environment does it
        assert np.array_equal(file["observation"][()], scene.observations)
        assert file["observation"].dtype == np.uint8
        assert np.array_equal(file["resnet_feature"][3][0][:, np.newaxis], scene.features[3][:, None])
        assert np.array_equal(file["location"][()], scene.locations_m)
        assert np.array_equal(file["rotation"][()], scene.headings_deg)
        assert np.array_equal(file["graph"][()], scene.graph)
        assert file["graph"].dtype == np.int32
        assert np.array_equal(file["shortest_path_distance"][()], scene.distances)
        for dataset in file.values():
            assert not isinstance(dataset, h5py.Dataset) or dataset.fletcher32
        assert file["observation"].chunks == (1, 30, 40, 3)


@pytest.mark.parametrize("axis", [10, 1])
def test_published_dumps_are_read_as_they_are(tmp_path: Path, axis: int) -> None:
    made = published_dump(tmp_path / "bathroom_02.h5", axis=axis)
    scene = read_scene(tmp_path / "bathroom_02.h5")
    assert scene.name == "bathroom_02"
    assert np.array_equal(scene.features, made.features)  # index 0; the others are larger by 1
    assert np.array_equal(scene.graph, made.graph)
    assert scene.graph.dtype == np.int32
    assert np.array_equal(scene.headings_deg, made.headings_deg)
    assert np.array_equal(scene.observations[5], made.observations[5])
    assert scene.cell_size_m == 0.5
    assert scene.made_by.source == "thor_v1"
    assert scene.encoder.identity == "thor_v1-16"


@pytest.mark.parametrize("unreachable", [-1, 1000])
def test_either_mark_of_unreachable_is_accepted(tmp_path: Path, unreachable: int) -> None:
    def split(file: h5py.File) -> None:
        graph = graph_of_cells(np.array([[0, 0], [0, 1], [5, 0], [5, 1]]))
        steps = distances(graph)
        file["graph"][()] = graph
        file["location"][8:, 0] += 2.5
        file["location"][8:, 1] -= 1.0
        file["shortest_path_distance"][()] = np.where(steps < 0, unreachable, steps)

    published_dump(tmp_path / "a.h5", split)
    scene = read_scene(tmp_path / "a.h5")
    assert scene.distances[0, 8] == -1


def test_wrong_distances_are_told_and_not_used(tmp_path: Path) -> None:
    def lie(file: h5py.File) -> None:
        file["shortest_path_distance"][0, 5] = 77

    made = published_dump(tmp_path / "a.h5", lie)
    with pytest.warns(SceneWarning, match="wrong for 1 pairs .first: 77.0 steps from state 0 to 5"):
        scene = read_scene(tmp_path / "a.h5")
    assert np.array_equal(scene.distances, made.distances)


def test_observation_and_distances_are_optional(tmp_path: Path) -> None:
    def drop(file: h5py.File) -> None:
        del file["observation"], file["shortest_path_distance"]

    published_dump(tmp_path / "a.h5", drop)
    scene = read_scene(tmp_path / "a.h5")
    assert scene.observations is None
    assert scene.distances.max() == 5


def test_the_cell_size_is_the_length_of_most_moves() -> None:
    scene = corridor_scene(5)
    locations_m = scene.locations_m.copy()
    locations_m[16:, 1] += 0.1  # the last cell lies off the grid
    assert step_length_m(locations_m, scene.graph) == 0.5


def test_odd_poses_only_warn(tmp_path: Path) -> None:
    published_dump(tmp_path / "a.h5", lambda file: file["rotation"].write_direct(np.full(16, 90, np.float32)))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        read_scene(tmp_path / "a.h5")
    assert {warning.category for warning in told} == {SceneWarning}
    assert any("a right turn changes the heading by 90" in str(warning.message) for warning in told)


def test_pictures_are_read_as_an_array_is(tmp_path: Path) -> None:
    scene = full_scene()
    write_scene(scene, tmp_path / "a.h5")
    pictures, expected = read_scene(tmp_path / "a.h5").observations, scene.observations
    assert isinstance(pictures, FilePictures)
    assert pictures.shape == expected.shape
    for index in (
        0,
        -1,
        np.int64(3),
        slice(2, 9),
        slice(None, None, -7),
        slice(5, 5),
        np.array([4, 4, 1, 7]),
        np.array([[0, 2], [2, 1]]),
        np.array([], int),
    ):
        assert np.array_equal(pictures[index], expected[index])
    with pytest.raises(IndexError):
        pictures[len(expected)]
    assert np.array_equal(pickle.loads(pickle.dumps(pictures))[6], expected[6])


def test_pictures_of_a_replaced_or_deleted_file_are_refused(tmp_path: Path) -> None:
    write_scene(full_scene(), tmp_path / "a.h5")
    pictures = read_scene(tmp_path / "a.h5").observations
    write_scene(corridor_scene(3), tmp_path / "a.h5")
    with pytest.raises(SceneError, match="has changed since"):
        pictures[0]
    (tmp_path / "a.h5").unlink()
    with pytest.raises(SceneError, match="has changed since"):
        pictures[0]


def test_pictures_of_a_file_written_to_in_place_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    write_scene(full_scene(), path)
    pictures, before = read_scene(path).observations, path.stat()
    path.write_bytes(path.read_bytes())
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns + 10**9))  # its clock may tick slower than this test
    assert (path.stat().st_ino, path.stat().st_size) == (before.st_ino, before.st_size)
    with pytest.raises(SceneError, match="has changed since"):
        pictures[0]


def test_a_scene_may_be_written_over_its_own_file(tmp_path: Path) -> None:
    scene = full_scene()
    write_scene(scene, tmp_path / "a.h5")
    write_scene(read_scene(tmp_path / "a.h5"), tmp_path / "a.h5")
    assert np.array_equal(read_scene(tmp_path / "a.h5").observations[:], scene.observations)
    assert [file.name for file in tmp_path.iterdir()] == ["a.h5"]


def test_an_unsound_scene_is_not_written(tmp_path: Path) -> None:
    scene = corridor_scene(3)
    with pytest.raises(SceneError, match="expected -1 to 11"):
        write_scene(replace(scene, graph=scene.graph + 9), tmp_path / "a.h5")
    assert list(tmp_path.iterdir()) == []


def test_a_place_that_cannot_be_written_is_one_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(SceneError, match="cannot be written"):
        write_scene(corridor_scene(3), tmp_path / "file" / "a.h5")


@pytest.mark.parametrize("name", ["graph", "location", "rotation", "resnet_feature", "shortest_path_distance"])
def test_a_flipped_bit_is_noticed(tmp_path: Path, name: str) -> None:
    flip_bit(tmp_path / "a.h5", name)
    with pytest.raises(SceneError, match="is damaged") as caught:
        read_scene(tmp_path / "a.h5")
    assert caught.value.dataset == name


def test_a_flipped_bit_in_a_picture_is_noticed_when_it_is_looked_at(tmp_path: Path) -> None:
    flip_bit(tmp_path / "a.h5", "observation")
    pictures = read_scene(tmp_path / "a.h5").observations
    assert pictures[1].shape == (30, 40, 3)
    with pytest.raises(SceneError, match="is damaged") as caught:
        pictures[0]
    assert caught.value.dataset == "observation"


def flip_bit(path: Path, name: str) -> None:
    """Write a scene and flip one bit amid the first chunk of one of its datasets."""
    write_scene(full_scene(), path)
    with h5py.File(path, "r") as file:
        chunk = file[name].id.get_chunk_info(0)
    content = bytearray(path.read_bytes())
    content[chunk.byte_offset + chunk.size // 2] ^= 0x10
    path.write_bytes(content)


@pytest.mark.parametrize("name", ["graph", "location", "rotation"])
def test_a_missing_dataset_is_named(tmp_path: Path, name: str) -> None:
    published_dump(tmp_path / "a.h5", lambda file: file.pop(name))
    with pytest.raises(SceneError, match="is missing") as caught:
        read_scene(tmp_path / "a.h5")
    assert caught.value.dataset == name


def test_a_crowded_encoder_group_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_scene(full_scene(), tmp_path / "a.h5")
    monkeypatch.setattr(hdf5, "MAX_GROUP_ARRAYS", 2)
    with pytest.raises(SceneError, match="group of at most 2 arrays"):
        read_scene(tmp_path / "a.h5")


def test_pictures_from_0_to_1_are_refused_not_stored_as_black(tmp_path: Path) -> None:
    scene = full_scene()
    path = tmp_path / "attic.h5"
    with pytest.raises(SceneError, match=r"attic\.h5: observations is an array of float64, expected .* uint8"):
        write_scene(replace(scene, observations=scene.observations / 255), path)
    assert not path.exists()


FILL_UP = """
import sys; sys.path[:] = {path!r}
import os, resource
from dataclasses import replace
from pathlib import Path
import numpy as np
from clearway.errors import SceneError
from clearway.scenes.export import export_thor_v1
from clearway.scenes.thor_v1 import write_scene
from helpers.made import corridor_scene

pictures = np.random.default_rng(0).integers(0, 256, (12, 60, 80, 3), np.uint8)  # which pack badly
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, -1))
try:
    {write}(replace(corridor_scene(3), observations=pictures), Path({file!r}))
except SceneError as error:
    print(error, flush=True)
    os._exit(0)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="limits the size of files as Linux does")
@pytest.mark.parametrize("write", ["write_scene", "export_thor_v1"])
def test_a_disk_that_fills_up_is_one_error_and_leaves_nothing(tmp_path: Path, write: str) -> None:
    """In a process of its own that ends at once, since HDF5 complains once more, or crashes, when it lets go of it."""
    script = FILL_UP.format(path=sys.path, write=write, file=str(tmp_path / "a.h5"))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "a.h5: cannot be written (" in done.stdout and "has room" in done.stdout
    assert list(tmp_path.iterdir()) == []
