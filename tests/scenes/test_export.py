from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.scenes.export import export_thor_v1
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import read_scene
from helpers.made import grid_scene


class PublishedLoader:
    """How the code that came with the published dumps reads them (Zhu et al., 2017)."""

    def __init__(self, path: Path) -> None:
        self.file = h5py.File(path, "r")
        self.locations = self.file["location"][()]
        self.rotations = self.file["rotation"][()]
        self.transition_graph = self.file["graph"][()]
        self.shortest_path_distances = self.file["shortest_path_distance"][()]

    def state(self, index: int) -> np.ndarray:
        return self.file["resnet_feature"][index][0][:, np.newaxis]

    def observation(self, index: int) -> np.ndarray:
        return self.file["observation"][index]


def test_the_published_loader_reads_what_was_exported(tmp_path: Path) -> None:
    scene = grid_scene(1)
    export_thor_v1(scene, tmp_path / "grid.h5")
    loaded = PublishedLoader(tmp_path / "grid.h5")
    np.testing.assert_array_equal(loaded.transition_graph, scene.graph)
    np.testing.assert_array_equal(loaded.locations, scene.locations_m)
    np.testing.assert_array_equal(loaded.rotations, scene.headings_deg)
    np.testing.assert_array_equal(loaded.shortest_path_distances, scene.distances)
    np.testing.assert_array_equal(loaded.state(5)[:, 0], scene.features[5])
    np.testing.assert_array_equal(loaded.observation(5), scene.observations[5])
    assert set(loaded.file) == {
        "graph", "location", "rotation", "shortest_path_distance", "resnet_feature", "observation",
    }  # fmt: skip
    assert not loaded.file.attrs


def test_an_exported_scene_comes_back(tmp_path: Path) -> None:
    scene = grid_scene(2)
    export_thor_v1(scene, tmp_path / "grid.h5")
    back = read_scene(tmp_path / "grid.h5")
    np.testing.assert_array_equal(back.graph, scene.graph)
    np.testing.assert_array_equal(back.features, scene.features)
    assert back.cell_size_m == scene.cell_size_m


def without_features(scene: Scene) -> Scene:
    return replace(scene, features=None, encoder=None)


@pytest.mark.parametrize("change", [without_features, lambda scene: replace(scene, observations=None)])
def test_what_the_layout_needs_must_be_there(change, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="lacks pictures or features"):
        export_thor_v1(change(grid_scene(1)), tmp_path / "grid.h5")
    assert not list(tmp_path.iterdir())


def test_it_is_a_file_that_hdf5_1_8_reads(tmp_path: Path) -> None:
    export_thor_v1(grid_scene(1), tmp_path / "grid.h5")
    with h5py.File(tmp_path / "grid.h5", "r") as file:
        superblock = file.id.get_create_plist().get_version()[0]
    assert superblock <= 2  # HDF5 1.10 brought the third
