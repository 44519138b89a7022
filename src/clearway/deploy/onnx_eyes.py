"""`OnnxEyes`: eyes in an exported file, an `Encoder` and a `Sight`, on onnxruntime alone.

The file's graph has three parts, of which a call asks for one; the others get no rows.

Axes: B pictures, P pairs, F features.
"""

from __future__ import annotations

import numpy as np

from clearway.deploy.onnx_file import OnnxFile
from clearway.errors import EncoderError
from clearway.perception.around import PLACES_M
from clearway.perception.whereabouts import ELSEWHERE
from clearway.scenes.scene import EncoderRecord

AT_ONCE = 512  # pairs
NOTHING = np.zeros((0, 4, 4, 3), np.uint8)


class OnnxEyes:
    """Eyes that see and compare.

    Args:
        file: that holds them.
        record: what they are.
        description_width: of descriptions, which features begin with.
    """

    def __init__(self, file: OnnxFile, record: EncoderRecord, description_width: int) -> None:
        self._file, self.record, self._description_width = file, record, description_width
        self.feature_count = file.card.feature_count
        self._none = np.zeros((0, self.feature_count), np.float32)

    def encode(self, pictures: np.ndarray) -> np.ndarray:
        """Features (B, F) float32 of pictures (B, height, width, 3) uint8. Raises EncoderError for anything else."""
        if pictures.ndim != 4 or pictures.shape[3] != 3 or pictures.dtype != np.uint8 or 0 in pictures.shape[1:3]:
            problem = f"pictures are {pictures.dtype} {pictures.shape}, expected uint8 (count, height, width, 3)"
            raise EncoderError(f"{problem}. Give RGB pictures")
        shape = len(pictures), self.feature_count
        return self._told("features", shape, picture=np.ascontiguousarray(pictures))

    def description(self, features: np.ndarray) -> np.ndarray:
        """See `Sight`."""
        return features[:, : self._description_width]

    def stands(self, features: np.ndarray) -> np.ndarray:
        """See `Sight`."""
        if not len(features):
            return np.zeros((0, len(PLACES_M)), np.float32)
        return self._told("stands", (len(features), len(PLACES_M)), seen=np.asarray(features, np.float32))

    def whereabouts(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """See `Sight`."""
        pairs = [np.asarray(features, np.float32) for features in (first, second)]
        parts = []
        for begin in range(0, len(first), AT_ONCE):
            one, other = (features[begin : begin + AT_ONCE] for features in pairs)
            parts.append(self._told("whereabouts", (len(one), ELSEWHERE), first=one, second=other))
        return np.concatenate(parts) if parts else np.zeros((0, ELSEWHERE), np.float32)

    def _told(self, output: str, shape: tuple[int, ...], **given: np.ndarray) -> np.ndarray:
        """One of the graph's outputs, of this shape, by its inputs."""
        nothing: dict[str, np.ndarray] = dict.fromkeys(("seen", "first", "second"), self._none)
        return self._file.run({output: shape}, nothing | {"picture": NOTHING} | given)[0]
