"""Reads a scene file again and again, each time with one bit flipped; a process of its own, which may crash.

    python flipped_bits.py FILE BIT...     prints, for each bit, "BIT refused", "BIT same" or "BIT wrong"

`same`: the scene was read, and nothing of it differs. `wrong`: something differs and nobody was told.
"""

import hashlib
import json
import sys
import tempfile
import warnings
from dataclasses import asdict
from pathlib import Path

import numpy as np

from clearway.errors import SceneError
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import read_scene
from clearway.scenes.validate import SceneWarning


def digest(scene: Scene) -> str:
    """Of all that a scene holds."""
    found = hashlib.sha256()
    arrays = [scene.graph, scene.locations_m, scene.headings_deg, scene.features, scene.observations[:]]
    arrays += [scene.top_view.image] if scene.top_view else []
    for array in arrays:
        found.update(f"{array.shape} {array.dtype}".encode())
        found.update(np.ascontiguousarray(array).tobytes())
    view = scene.top_view and [scene.top_view.x_min_m, scene.top_view.x_max_m, scene.top_view.z_min_m]
    encoder = scene.encoder
    statistics = {name: values.tolist() for name, values in encoder.arrays.items()}
    texts = [
        asdict(scene.made_by),
        scene.cell_size_m,
        view,
        encoder.name,
        encoder.identity,
        encoder.settings,
        statistics,
    ]
    found.update(json.dumps(texts, sort_keys=True, default=dict).encode())
    return found.hexdigest()


def read(path: Path) -> str:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SceneWarning)
        return digest(read_scene(path, name="scene"))


def main(path: Path, bits: list[int]) -> None:
    whole = path.read_bytes()
    expected = read(path)
    with tempfile.TemporaryDirectory() as folder:
        hurt = Path(folder) / "hurt.h5"
        for bit in bits:
            content = bytearray(whole)
            content[bit // 8] ^= 1 << bit % 8
            hurt.write_bytes(content)
            try:
                outcome = "same" if read(hurt) == expected else "wrong"
            except SceneError:
                outcome = "refused"
            print(bit, outcome, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), [int(word) for word in sys.argv[2:]])
