import pickle
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.scenes import hdf5
from clearway.scenes.graph import distances
from clearway.scenes.pictures import FilePictures
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import FORMAT_VERSION, read_scene, write_scene
from clearway.scenes.validate import SceneWarning
from made import corridor_scene, graph_of_cells, grid_scene


def full_scene() -> Scene:
    """A scene in which no part is missing or at its default."""
    scene = grid_scene(5, name="attic", picture_size=(30, 40))
    encoder = replace(
        scene.encoder,
        settings={"seed": 3, "size": [224, 298], "mean": [0.5, 0.25, 0.125], "model": None},
        arrays={
            "feature_mean": np.linspace(0, 1, 7, dtype=np.float32),
            "count": np.array(5),
            "none": np.zeros((0, 3)),
        },
    )
    made_by = replace(scene.made_by, notes={"light": {"lamps": 3}, "remark": "ä"})
    return replace(scene, encoder=encoder, made_by=made_by, cell_size_m=0.5)


def published_dump(path: Path, change: Callable[[h5py.File], None] | None = None, axis: int = 10) -> Scene:
    """A file as other code writes it: plain datasets, tiled features, floats, 1000 for unreachable."""
    scene = corridor_scene(4)
    steps = np.where(scene.distances < 0, 1000, scene.distances).astype(np.float32)
    with h5py.File(path, "w") as file:
        file["observation"] = scene.observations
        file["resnet_feature"] = np.repeat(scene.features[:, None], axis, axis=1)
        file["resnet_feature"][:, 1:] += 1
        file["location"] = scene.locations_m.astype(np.float32)
        file["rotation"] = scene.headings_deg.astype(np.float32)
        file["graph"] = scene.graph.astype(np.float32)
        file["shortest_path_distance"] = steps
        if change is not None:
            change(file)
    return scene


def replaced(name: str, values: object) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        del file[name]
        file[name] = values

    return change


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


def test_files_that_are_no_scene(tmp_path: Path) -> None:
    for path, content in {"text.h5": b"hello", "empty.h5": b"", "zip.h5": b"PK\x03\x04" + bytes(600)}.items():
        (tmp_path / path).write_bytes(content)
        with pytest.raises(SceneError, match="is not an HDF5 file"):
            read_scene(tmp_path / path)
    for path in (tmp_path / "none.h5", tmp_path):
        with pytest.raises(SceneError, match="there is no such file"):
            read_scene(path)


def test_truncated_files(tmp_path: Path) -> None:
    write_scene(full_scene(), tmp_path / "whole.h5")
    whole = (tmp_path / "whole.h5").read_bytes()
    for share in (0.01, 0.1, 0.5, 0.9, 0.99):
        (tmp_path / "part.h5").write_bytes(whole[: int(len(whole) * share)])
        with pytest.raises(SceneError):
            read_scene(tmp_path / "part.h5")


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


def drop_what_is_seen(file: h5py.File) -> None:
    del file["observation"], file["resnet_feature"]


def link_out(file: h5py.File) -> None:
    del file["graph"]
    file["graph"] = h5py.ExternalLink("other.h5", "graph")


def link_within(file: h5py.File) -> None:
    file.move("graph", "hidden")
    file["graph"] = h5py.SoftLink("/hidden")


def make_virtual(file: h5py.File) -> None:
    layout = h5py.VirtualLayout(shape=(16, 4), dtype=np.int32)
    layout[:] = h5py.VirtualSource("other.h5", "graph", shape=(16, 4))
    del file["graph"]
    file.create_virtual_dataset("graph", layout)


def store_outside(file: h5py.File) -> None:
    del file["location"]
    outside = [("outside.bin", 0, h5py.h5f.UNLIMITED)]
    file.create_dataset("location", (16, 2), np.float32, external=outside)


def claim_huge_pictures(file: h5py.File) -> None:
    del file["observation"]
    file.create_dataset("observation", (16, 100_000, 100_000, 3), np.uint8, chunks=(1, 64, 64, 3))


def claim_huge_features(file: h5py.File) -> None:
    del file["resnet_feature"]
    file.create_dataset("resnet_feature", (16, 1, 2**40), np.float32, chunks=(1, 1, 64))


def claim_many_states(file: h5py.File) -> None:
    del file["graph"]
    file.create_dataset("graph", (2**40, 4), np.int32, chunks=(64, 4))


def use_huge_chunks(file: h5py.File) -> None:
    del file["resnet_feature"]
    file.create_dataset("resnet_feature", (16, 1, 8), np.float32, chunks=(1, 1, 2**28), maxshape=(16, 1, None))


SCENE = corridor_scene(4)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (replaced("graph", SCENE.graph + 1), "whole numbers from -1 to 15"),
        (replaced("graph", SCENE.graph - 1), "whole numbers from -1 to 15"),
        (replaced("graph", SCENE.graph + 0.5), "whole numbers from -1 to 15"),
        (replaced("graph", np.full((16, 4), np.nan)), "whole numbers from -1 to 15"),
        (replaced("graph", np.full((16, 4), 2**63, np.uint64)), "whole numbers from -1 to 15"),
        (replaced("graph", SCENE.graph[:, :3]), "has shape (16, 3), expected (any, 4)"),
        (replaced("graph", np.zeros((0, 4), np.int32)), "has 0 states"),
        (replaced("graph", np.zeros((1, 4), np.int32)), "has 1 states"),
        (replaced("graph", 5), "has shape (), expected"),
        (replaced("graph", "text"), "has shape (), expected"),
        (replaced("graph", h5py.Empty("f4")), "has shape None, expected"),
        (replaced("graph", np.full((16, 4), b"ab")), "expected numbers"),
        (replaced("graph", np.zeros((16, 4), [("a", "i4")])), "expected numbers"),
        (replaced("graph", np.zeros((16, 4), complex)), "expected numbers"),
        (lambda file: (file.pop("graph"), file.create_group("graph")), "is not a dataset"),
        (replaced("location", SCENE.locations_m[:-1]), "has shape (15, 2)"),
        (replaced("location", np.full((16, 2), np.inf)), "NaN, Inf"),
        (replaced("rotation", np.full(16, np.nan)), "no headings"),
        (replaced("rotation", SCENE.headings_deg * 1000), "no headings"),
        (replaced("resnet_feature", np.full((16, 1, 8), np.nan)), "NaN or Inf"),
        (replaced("resnet_feature", np.full((16, 1, 8), 1e300)), "NaN or Inf"),
        (replaced("resnet_feature", np.zeros((16, 0, 8), np.float32)), "has shape (16, 0, 8)"),
        (replaced("resnet_feature", np.zeros((16, 1, 8), np.int32)), "expected numbers"),
        (replaced("resnet_feature", np.zeros((15, 1, 8), np.float32)), "has shape (15, 1, 8)"),
        (replaced("observation", SCENE.observations.astype(np.uint16)), "expected uint8"),
        (replaced("observation", SCENE.observations[..., :2]), "has shape"),
        (replaced("shortest_path_distance", np.zeros((3, 3))), "has shape (3, 3)"),
        (drop_what_is_seen, "neither pictures nor features"),
        (link_out, "is a link"),
        (link_within, "is a link"),
        (make_virtual, "keeps its values in another file"),
        (store_outside, "keeps its values in another file"),
        (claim_huge_pictures, "sides up to"),
        (claim_huge_features, "expected 1 to 65536 features"),
        (claim_many_states, "more than the limit"),
        (use_huge_chunks, "chunks"),
    ],
)
def test_faulty_dumps_are_one_clear_error(tmp_path: Path, change: Callable[[h5py.File], None], problem: str) -> None:
    published_dump(tmp_path / "a.h5", change)
    with pytest.raises(SceneError) as caught:
        read_scene(tmp_path / "a.h5")
    assert problem in str(caught.value)
    assert "a.h5" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "value", "problem"),
    [
        ("format_version", FORMAT_VERSION + 1, "reads up to 1. Upgrade clearway"),
        ("format_version", "new", "attribute 'format_version' is 'new'"),
        ("cell_size_m", np.nan, "attribute 'cell_size_m' is nan"),
        ("cell_size_m", np.ones(3), "neither a number nor a text"),
        ("made_by", "{", "attribute 'made_by' is not JSON"),
        ("made_by", "[" * 100_000, "attribute 'made_by' is not JSON"),
        ("made_by", "[1]", "attribute 'made_by' is not a JSON object"),
        ("made_by", '{"source": 5}', "lacks the text 'source'"),
        ("made_by", '{"source": "room", "versions": 3}', "no object as 'versions'"),
        ("encoder", '{"name": "x"}', "lacks the text 'identity'"),
    ],
)
def test_faulty_attributes_are_one_clear_error(tmp_path: Path, name: str, value: object, problem: str) -> None:
    write_scene(full_scene(), tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        file.attrs[name] = value
    with pytest.raises(SceneError) as caught:
        read_scene(tmp_path / "a.h5")
    assert problem in str(caught.value)
    assert len(str(caught.value)) < 500


def test_a_crowded_encoder_group_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_scene(full_scene(), tmp_path / "a.h5")
    monkeypatch.setattr(hdf5, "MAX_GROUP_ARRAYS", 2)
    with pytest.raises(SceneError, match="group of at most 2 arrays"):
        read_scene(tmp_path / "a.h5")


def test_damage_anywhere_is_a_scene_error_or_harmless(tmp_path: Path) -> None:
    """Overwrite 64 bytes at random places: the reader must never raise anything else."""
    published_dump(tmp_path / "whole.h5")
    write_scene(full_scene(), tmp_path / "ours.h5")
    rng = np.random.default_rng(0)
    outcomes = {"read": 0, "refused": 0}
    for source in ("whole.h5", "ours.h5"):
        whole = (tmp_path / source).read_bytes()
        for _ in range(40):
            content = bytearray(whole)
            start = int(rng.integers(len(whole) - 64))
            content[start : start + 64] = rng.bytes(64)
            (tmp_path / "hurt.h5").write_bytes(content)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", SceneWarning)
                try:
                    read_scene(tmp_path / "hurt.h5").observations[:]
                    outcomes["read"] += 1
                except SceneError:
                    outcomes["refused"] += 1
    assert outcomes["refused"] > 20
