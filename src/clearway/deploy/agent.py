"""`DeployedAgent`, an agent with its card; and checks of what it is given.

Axis letters: F features.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np

from clearway.agents.agent import FEATURES, Agent, Observation, State
from clearway.deploy.card import Card
from clearway.errors import DeployError
from clearway.scenes.aspect import other_aspect
from clearway.scenes.sensors import RGB

if TYPE_CHECKING:
    from clearway.mapping.room_map import RoomMap

MAX_PICTURE_SIDE = 4_096  # pixels


class DeployedAgent(Agent, Protocol):
    """A trained agent, however it is computed, that says what it is."""

    @property
    def card(self) -> Card:
        """What the agent is."""


@runtime_checkable
class KeepsMaps(Protocol):
    """A deployed agent that may tour a room, and keeps a map of it."""

    def explorer(self) -> Agent:
        """Who tours a room; targets are of no interest to it."""

    def map_of(self, state: State) -> RoomMap:
        """What a tour has found, by the explorer's state."""

    def knowing(self, known: RoomMap) -> Agent:
        """The agent in the room of a map."""

    def write_map(self, path: Path, known: RoomMap) -> None:
        """Write a map to a file. Raises OSError."""

    def read_map(self, path: Path) -> RoomMap:
        """The map in a file. Raises DeployError where it is none that the agent can go by."""


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
    return checked_picture(seen, card) if card.takes_pictures else _checked_features(seen, card)


def _array(seen: object, wanted: str) -> np.ndarray:
    try:
        return np.asarray(seen)
    except (ValueError, OSError) as fault:  # rows of unequal lengths; a picture whose file is cut off
        reason = " ".join(str(fault).split())[:120]
        raise DeployError(f"what is seen is no {wanted} ({reason}). Give an array") from fault


def checked_picture(seen: object, card: Card | None = None) -> np.ndarray:
    """The picture, (height, width, 3) uint8, for an agent, or for one that is unknown.

    Raises:
        DeployError: it is something else, too large, or has another aspect than the pictures of the agent's training.
    """
    picture = _array(seen, "picture")
    if picture.dtype.kind in "US":
        raise DeployError("the picture is a text. Give its pixels: of a file, np.asarray(PIL.Image.open(path))")
    if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3 or 0 in picture.shape:
        problem = f"the picture is {picture.dtype} {picture.shape}, expected uint8 (height, width, 3)"
        raise DeployError(f"{problem}. Give an RGB picture with values from 0 to 255")
    if max(picture.shape) > MAX_PICTURE_SIDE:
        problem = f"the picture is {picture.shape[1]} x {picture.shape[0]} pixels"
        raise DeployError(f"{problem}, expected at most {MAX_PICTURE_SIDE} a side. Make it smaller first")
    if card is not None and (aspect := aspect_problem(picture, card)):
        raise DeployError(aspect)
    return picture


def aspect_problem(picture: np.ndarray, card: Card) -> str | None:
    """What is to be told of a picture (height, width, 3) whose aspect is not that of the agent's training."""
    if card.picture_size is None:
        return None
    return other_aspect(picture.shape[:2], card.picture_size)


def _checked_features(seen: object, card: Card) -> np.ndarray:
    features = _array(seen, "feature vector")
    if features.dtype.kind != "f" or features.shape != (card.feature_count,):
        problem = f"given {features.dtype} {features.shape}, expected features, float32 ({card.feature_count},)"
        remedy = f"Encode the picture with {card.encoder.get('name')} first, or use an agent exported with its encoder"
        raise DeployError(f"{problem}. {remedy}")
    with np.errstate(over="ignore"):  # what float32 cannot hold is Inf, and refused as such
        features = features.astype(np.float32)
    if not np.isfinite(features).all():
        raise DeployError("the features hold NaN or Inf. Check the encoder")
    return features
