"""`DeployedAgent`, an agent with its card; and checks of what it is given.

Axis letters: F features.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from clearway.agents.agent import FEATURES, Agent, Observation
from clearway.deploy.card import Card
from clearway.errors import DeployError
from clearway.scenes.sensors import RGB

MAX_PICTURE_SIDE = 4_096  # pixels


class DeployedAgent(Agent, Protocol):
    """A trained agent for one scene, however it is computed, that says what it is."""

    @property
    def card(self) -> Card:
        """What the agent is."""


def sight_of(card: Card) -> str:
    """Name of the sensor that an agent sees by: colour pictures, or features of them."""
    return RGB if card.takes_pictures else FEATURES


def as_observation(seen: object, card: Card) -> Observation:
    """What one agent sees, as a batch of one.

    Raises:
        DeployError: it is something else, too large, or not finite.
    """
    return {sight_of(card): checked_seen(seen, card)[None]}


def checked_seen(seen: object, card: Card) -> np.ndarray:
    """What an agent sees, one picture (height, width, 3) uint8 or one feature vector (F,) float32.

    Raises:
        DeployError: it is something else, too large, or not finite.
    """
    try:
        array = np.asarray(seen)
    except ValueError as fault:  # rows of unequal lengths
        wanted, reason = "picture" if card.takes_pictures else "feature vector", " ".join(str(fault).split())[:120]
        raise DeployError(f"what is seen is no {wanted} ({reason}). Give an array") from fault
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
    with np.errstate(over="ignore"):  # what float32 cannot hold is Inf, and refused as such
        features = features.astype(np.float32)
    if not np.isfinite(features).all():
        raise DeployError("the features hold NaN or Inf. Check the encoder")
    return features
