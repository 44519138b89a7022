"""Scenes for other people's loaders: the published `thor_v1` layout and nothing else, readable by HDF5 1.8."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clearway.errors import SceneError
from clearway.scenes.file_pictures import BLOCK_PICTURES
from clearway.scenes.hdf5 import written
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import DISTANCE_TABLE_STATES
from clearway.scenes.validate import check_scene


def export_thor_v1(scene: Scene, path: Path) -> None:
    """Write a scene as the published dumps are: uncompressed, without attributes or checksums, whole or not at all.

    `resnet_feature` is (S, 1, F): published loaders read index 0 of the second axis.

    Raises:
        SceneError: the scene is unsound, lacks pictures or features, has too many states for a distance table, or its
            headings are not four (published loaders know no others); or it cannot be written.
    """
    check_scene(scene, path)
    if scene.features is None or scene.observations is None:
        raise SceneError(scene.name, "lacks pictures or features, which the layout has", "Encode it, or give another")
    if scene.state_count > DISTANCE_TABLE_STATES:
        problem = f"has {scene.state_count} states; the layout's distance table would be too large"
        raise SceneError(scene.name, problem, f"Export scenes of up to {DISTANCE_TABLE_STATES}")
    if scene.heading_count != 4:
        raise SceneError(scene.name, f"has {scene.heading_count} headings, expected 4", "Export another scene")
    with written(path, libver=("earliest", "v108")) as file:
        file["graph"] = scene.graph.astype(np.int64)
        file["location"] = scene.locations_m
        file["rotation"] = scene.headings_deg
        file["shortest_path_distance"] = scene.distances.astype(np.int64)
        file["resnet_feature"] = np.asarray(scene.features)[:, None]
        pictures = file.create_dataset("observation", scene.observations.shape, np.uint8)
        for start in range(0, scene.state_count, BLOCK_PICTURES):
            pictures[start : start + BLOCK_PICTURES] = scene.observations[start : start + BLOCK_PICTURES]
