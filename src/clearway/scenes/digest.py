"""What tells whether two scenes are the same to a training."""

from __future__ import annotations

import hashlib

import numpy as np

from clearway.scenes.scene import Scene


def scene_digest(scene: Scene) -> str:
    """Short SHA-256 of what training sees of a scene: graph, poses, features."""
    digest = hashlib.sha256()
    for array in (scene.graph, scene.locations_m, scene.headings_deg, scene.features):
        if array is not None:
            digest.update(str((array.shape, array.dtype.str)).encode())
            digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()[:16]
