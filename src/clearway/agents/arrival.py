"""`Arrival`: whether what is seen is the target, by how alike the two pictures' features are.

For agents whose network does not say so itself. The threshold follows from a scene's own pictures alone.

Axis letters: B episodes, S states, F features.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

QUANTILE = 0.7
"""Of the likeness of the nearest other picture, over a scene's poses: the threshold. Chosen on rooms of `validation`,
where false and missed arrivals then are about as frequent (`benchmarks/arrivals.py`)."""
SAME = 1 - 1e-6  # pictures as alike as that are the same one, of two poses
MOST = 1 - 1e-4  # that is asked for: features differ in their last bits between PyTorch and onnxruntime
ROWS = 1_024  # compared at once


@dataclass(frozen=True)
class Arrival:
    """Holds that this is the target where features are alike.

    Attributes:
        threshold: cosine of the angle between features, from which on it does.
        numbers: so many of the features are compared, from the first.
    """

    threshold: float
    numbers: int

    def __call__(self, seen: np.ndarray, target: np.ndarray) -> np.ndarray:
        """(B,) bool, of features (B, F) seen now and of the targets."""
        return likeness(seen[:, : self.numbers], target[:, : self.numbers]) >= self.threshold

    def to_json(self) -> dict[str, object]:
        """As JSON values."""
        return asdict(self)


def likeness(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """(B,) cosine of the angle between rows (B, F); 0 where one is nothing."""
    return (_of_length_one(first) * _of_length_one(second)).sum(axis=1)


def arrival_of_json(kept: object, feature_count: int) -> Arrival:
    """What `Arrival.to_json` gave, for features (B, F). Raises ValueError where it is something else."""
    match kept:
        case {"threshold": float(threshold), "numbers": int(numbers), **more} if not more:
            if -1 <= threshold <= 1 and 0 < numbers <= feature_count:
                return Arrival(threshold, numbers)
    raise ValueError(f"arrival is {kept!s:.80}")


def fitted_arrival(features: np.ndarray, numbers: int, quantile: float = QUANTILE) -> Arrival | None:
    """By features (S, F) of all pictures of a scene: at its threshold a share `quantile` of them resembles no other.

    None where there are no two different pictures.
    """
    rows = _of_length_one(np.asarray(features, np.float32)[:, :numbers])
    nearest = []
    for begin in range(0, len(rows), ROWS):
        alike = rows[begin : begin + ROWS] @ rows.T
        nearest.append(np.where(alike < SAME, alike, -1).max(axis=1))
    found = np.concatenate(nearest) if nearest else np.zeros(0)
    found = found[found > -1]
    if not len(found):
        return None
    return Arrival(min(float(np.quantile(found, quantile)), MOST), numbers)


def _of_length_one(rows: np.ndarray) -> np.ndarray:
    return rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-12)
