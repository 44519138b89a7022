"""`AgentModel`, what every deployed agent offers, however it is computed; and checks of what it is given.

Axis letters: B batch, K history (newest last), F features, A actions.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from clearway.deploy.card import Card
from clearway.errors import DeployError

MAX_PICTURE_SIDE = 4_096  # pixels


class ModelOutput(NamedTuple):
    """What agents make of what they see.

    Attributes:
        probabilities: (B, A) float32.
        value: (B, 1) float32, the discounted return that the agent expects, in units of the reward.
        history: (B, K, F) float32, to be given to the next step; its last row holds the features of what was seen.
    """

    probabilities: np.ndarray
    value: np.ndarray
    history: np.ndarray


class AgentModel(Protocol):
    """A trained agent for one scene. It keeps nothing between calls, and threads may share it."""

    @property
    def card(self) -> Card:
        """What the agent is."""

    def step(self, seen: np.ndarray, start: np.ndarray, history: np.ndarray, target: np.ndarray) -> ModelOutput:
        """One step of B agents, each with its own target.

        Args:
            seen: (B, height, width, 3) uint8 RGB pictures; or (B, F) float32 features, where the card says so.
            start: (B,) bool, an episode begins: what is seen fills the whole history, and `history` is not looked at.
            history: (B, K, F) float32, as the step before left it.
            target: (B, F) float32, features of the target.
        """


def features_of(model: AgentModel, seen: np.ndarray) -> np.ndarray:
    """Features (B, F) float32 of pictures (or of features, where the agent takes those)."""
    card, count = model.card, len(seen)
    history = np.zeros((count, card.history_length, card.feature_count), np.float32)
    return model.step(seen, np.ones(count, bool), history, history[:, 0]).history[:, -1]


def checked_seen(seen: object, card: Card) -> np.ndarray:
    """What an agent sees, one picture (height, width, 3) uint8 or one feature vector (F,) float32.

    Raises:
        DeployError: it is something else, too large, or not finite.
    """
    array = np.asarray(seen)
    return checked_picture(array) if card.takes_pictures else _checked_features(array, card)


def checked_picture(picture: np.ndarray) -> np.ndarray:
    """The picture, (height, width, 3) uint8. Raises DeployError where it is something else, or too large."""
    if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3 or 0 in picture.shape:
        problem = f"the picture is {picture.dtype} {picture.shape}, expected uint8 (height, width, 3)"
        raise DeployError(f"{problem}. Give an RGB picture with values from 0 to 255")
    if max(picture.shape) > MAX_PICTURE_SIDE:
        problem = f"the picture is {picture.shape[1]} x {picture.shape[0]} pixels"
        raise DeployError(f"{problem}, expected at most {MAX_PICTURE_SIDE} a side. Make it smaller first")
    return picture


def _checked_features(features: np.ndarray, card: Card) -> np.ndarray:
    if features.dtype.kind != "f" or features.shape != (card.feature_count,):
        problem = f"given {features.dtype} {features.shape}, expected features, float32 ({card.feature_count},)"
        remedy = f"Encode the picture with {card.encoder.get('name')} first, or use an agent exported with its encoder"
        raise DeployError(f"{problem}. {remedy}")
    if not np.isfinite(features).all():
        raise DeployError("the features hold NaN or Inf. Check the encoder")
    return features.astype(np.float32)
