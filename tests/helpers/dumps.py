"""Scene files for tests: one of ours in which nothing is missing, and dumps as other code writes them."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np

from clearway.scenes.scene import Scene
from helpers.made import corridor_scene, grid_scene, with_depth


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
    return with_depth(replace(scene, encoder=encoder, made_by=made_by, cell_size_m=0.5))


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
