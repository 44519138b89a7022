"""Made-up features for scenes without pictures: smooth random functions of the pose.

    phi_j(p, h) = max(0, m_j + 0.4 sqrt(2) cos(w_j . p + v_j . (sin h, cos h) + b_j) + 0.05 n_j(p, h))

at location p (metres) and heading h, with m_j ~ N(0.4, 0.2^2), w_j ~ N(0, I) a metre, v_j ~ N(0, 1.5^2 I), b_j uniform
on the circle, and a little noise n ~ N(0, 1) of the pose alone. Like pooled features of a picture network they are not
negative, alike where poses are near, and no two poses share them. They know nothing of walls or furniture: what is
learnt on them says what the learner can do, not what a camera would see.

Axis letters: S states, F features.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clearway.errors import SceneError
from clearway.scenes.hdf5 import MAX_ARRAY_BYTES
from clearway.scenes.scene import EncoderRecord
from clearway.scenes.validate import MAX_FEATURES

ENCODER = "made-up"
VERSION = 1  # of the formula; raise it when that changes
MEAN, MEAN_SPREAD = 0.4, 0.2
WAVE, NOISE = 0.4, 0.05
POSITION_FREQUENCY_PER_M, HEADING_FREQUENCY = 1.0, 1.5
BLOCK_STATES = 2048  # rows that are computed in float64 at a time


def made_up_features(
    locations_m: np.ndarray, headings_deg: np.ndarray, feature_count: int, seed: Sequence[int]
) -> np.ndarray:
    """Features of poses, (S, F) float32, by the formula above.

    Args:
        locations_m: (S, 2), x and z.
        headings_deg: (S,).
        feature_count: F.
        seed: another one gives other functions.
    """
    rng = np.random.default_rng(seed)
    mean = rng.normal(MEAN, MEAN_SPREAD, feature_count)
    by_position = rng.normal(0, POSITION_FREQUENCY_PER_M, (2, feature_count))
    by_heading = rng.normal(0, HEADING_FREQUENCY, (2, feature_count))
    phase = rng.uniform(0, 2 * np.pi, feature_count)
    turn = np.deg2rad(headings_deg)
    facing = np.stack([np.sin(turn), np.cos(turn)], axis=1)
    features = np.empty((len(locations_m), feature_count), np.float32)
    for first in range(0, len(features), BLOCK_STATES):
        rows = slice(first, first + BLOCK_STATES)
        angle = locations_m[rows] @ by_position + facing[rows] @ by_heading + phase
        value = mean + WAVE * np.sqrt(2) * np.cos(angle) + NOISE * rng.normal(size=angle.shape)
        features[rows] = np.maximum(value, 0)
    return features


def made_up_encoder(feature_count: int, seed: int) -> EncoderRecord:
    """The record of these features; scenes of one size and seed go together."""
    settings = {"kind": ENCODER, "version": VERSION, "feature_count": feature_count, "seed": seed}
    return EncoderRecord(ENCODER, f"{ENCODER}-{VERSION}-{feature_count}-{seed}", settings)


def check_made_up(feature_count: int, seed: int, state_count: int, source: str) -> None:
    """Check that such features can be made and kept for so many states.

    Raises:
        SceneError: the seed is negative, or there are too few or too many features; `source` is what it names.
    """
    most = min(MAX_FEATURES, MAX_ARRAY_BYTES // (4 * state_count))
    if not 1 <= feature_count <= most:
        problem = f"{feature_count} features asked for, {state_count} states can have 1 to {most}"
        raise SceneError(source, problem, "Ask for a number of features in that range")
    if seed < 0:
        raise SceneError(source, f"the seed must be 0 or more, found {seed}", "Choose another seed")
