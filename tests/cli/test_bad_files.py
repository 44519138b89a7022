"""Files that are no scene: one line that names the file, exit code 2, and nothing left behind."""

import h5py
import pytest


def cut_short(dump, path):
    whole = dump(path).read_bytes()
    path.write_bytes(whole[: len(whole) * 2 // 3])
    return path


def index_out_of_range(dump, path):
    def change(file: h5py.File) -> None:
        file["graph"][7, 0] = 76

    return dump(path, change=change)


def no_hdf5(dump, path):
    path.write_text("scene,target\n")
    return path


BAD = {
    cut_short: "cannot be opened as HDF5",
    index_out_of_range: "dataset 'graph': holds something else than whole numbers from -1 to 75",
    no_hdf5: "is not an HDF5 file",
}


@pytest.fixture(params=BAD, ids=lambda make: make.__name__)
def bad(request, dump, tmp_path):
    """A bad file and what is said about it."""
    return request.param(dump, tmp_path / "bathroom_02.h5"), BAD[request.param]


def test_import_refuses_it_and_leaves_nothing(clearway, dump, bad, tmp_path):
    path, problem = bad
    good = dump(tmp_path / "good.h5")
    assert clearway("scenes", "import", "thor-v1", good, path, "--out", tmp_path / "out").refusal(str(path), problem)
    assert not (tmp_path / "out").exists()


def test_train_refuses_it_and_leaves_nothing(clearway, bad, tmp_path):
    path, problem = bad
    assert clearway("train", path, "--out", tmp_path / "run").refusal(str(path), problem)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("command", [("scenes", "inspect"), ("oracle",)], ids=" ".join)
def test_others_refuse_it(clearway, bad, command):
    path, problem = bad
    assert clearway(*command, path, "--json").refusal(str(path), problem)


def test_a_picture_that_turns_out_damaged_leaves_nothing_half_written(clearway, trained, tmp_path):
    path = tmp_path / "bathroom_02.h5"
    content = bytearray(trained.scene.read_bytes())
    with h5py.File(trained.scene, "r") as file:
        chunk = file["observation"].id.get_chunk_info(40)
    content[chunk.byte_offset + chunk.size // 2] ^= 0x10
    path.write_bytes(content)
    answer = clearway("scenes", "import", "thor-v1", path, "--out", tmp_path / "out")
    assert answer.refusal(str(path), "dataset 'observation'", "is damaged")
    answer = clearway("scenes", "inspect", path, "--map", tmp_path / "map.png")
    assert answer.refusal(str(path), "dataset 'observation'", "is damaged")
    assert list((tmp_path / "out").iterdir()) == []


def test_a_dump_is_not_written_over_itself_or_its_namesake(clearway, dump, tmp_path):
    first, second = dump(tmp_path / "a" / "attic.h5"), dump(tmp_path / "b" / "attic.h5")
    before = first.read_bytes()
    assert clearway("scenes", "import", "thor-v1", first, "--out", first.parent).refusal(str(first), "--out")
    assert clearway("scenes", "import", "thor-v1", first, second, "--out", tmp_path / "out").refusal(
        str(first), "has this name"
    )
    assert first.read_bytes() == before
    assert not (tmp_path / "out").exists()


def test_scenes_that_do_not_belong_together(clearway, dump, tmp_path):
    def shorter(file: h5py.File) -> None:
        kept = file["resnet_feature"][:, :, :20]
        del file["resnet_feature"]
        file["resnet_feature"] = kept

    first, second = dump(tmp_path / "one.h5"), dump(tmp_path / "two.h5", change=shorter)
    assert clearway("train", first, second, "--out", tmp_path / "run").refusal(
        "two", "20 features", "encode FILES --encoder clearway "
    )


def test_a_scene_without_features_is_not_trained_on(clearway, dump, tmp_path):
    path = dump(tmp_path / "bare.h5", change=lambda file: file.pop("resnet_feature"))
    assert clearway("train", path, "--out", tmp_path / "run").refusal("features")
