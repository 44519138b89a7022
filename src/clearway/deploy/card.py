"""`Card`: what a deployed agent is, as its file says it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field

from clearway.choices import GENERALIST
from clearway.errors import DeployError
from clearway.files import parse_json
from clearway.scenes.actions import ACTION_COUNT

FORMAT_VERSION = 3  # 2 since there is `observation`, 3 since there is `kind`
EXPORT_AGAIN = "Export it again with clearway export"
SIAMESE = "siamese"
ARRIVAL = "arrival"  # among the settings of such an agent: by what it says where it has arrived
MOST_HISTORY, MOST_FEATURES, MOST_SIDE_PX = 1_000, 1_000_000, 100_000
ANY_ROOM = "any room"  # stands for the scene of an agent that is bound to none


@dataclass(frozen=True)
class Card:
    """What an agent acts in and what it has to be given.

    Attributes:
        scene: name of the scene whose layers of the network decide.
        actions: names of the actions, in the order of the probabilities.
        history_length: K, feature vectors that the agent decides by, the newest included.
        feature_count: F, numbers in a feature vector.
        takes_pictures: the encoder is inside: the agent takes pictures; else it takes feature vectors.
        encoder: name, identity and settings (JSON values) of what makes the features.
        normalisation: what is done to pictures and features, all of it inside the agent (JSON values).
        picture_size: (height, width) in pixels of the pictures that it was trained on, or None where that is unknown.
        training: what the agent was trained with, for the record (JSON values).
        observation: what a picture of the scene is to the encoder, as `Sensor.to_json` has it: name, shape, dtype, unit
            and range; None where that is unknown. Of the generalist also its lens, `vertical_fov_deg`.
        kind: of agent: `SIAMESE`, the paper's network in one scene, or `GENERALIST`.
        settings: what the agent goes by besides what its file computes (JSON values).
    """

    scene: str
    actions: tuple[str, ...]
    history_length: int
    feature_count: int
    takes_pictures: bool
    encoder: Mapping[str, object]
    normalisation: Mapping[str, object]
    picture_size: tuple[int, int] | None
    training: Mapping[str, object]
    observation: Mapping[str, object] | None = None
    kind: str = SIAMESE
    settings: Mapping[str, object] = field(default_factory=dict)

    @property
    def draws(self) -> bool:
        """The agent tells probabilities of its actions, and draws by them."""
        return self.kind != GENERALIST

    @property
    def tells_arrival(self) -> bool:
        """The agent says whether it has arrived. Files that were exported by an earlier clearway do not."""
        return self.kind == GENERALIST or ARRIVAL in self.settings

    def to_json(self) -> str:
        """As JSON text, for `card_from_json`."""
        return json.dumps({"format_version": FORMAT_VERSION, **asdict(self)})


def card_from_json(text: str, source: str) -> Card:
    """The card in a file's metadata.

    Raises:
        DeployError: it is no such card, or a newer clearway wrote it.
    """
    try:
        kept = parse_json(text)
        version = int(kept.pop("format_version"))
        if version > FORMAT_VERSION:
            raise DeployError(f"{source}: written by a newer clearway (format {version}). Upgrade clearway")
        size = kept["picture_size"]
        sizes = {"picture_size": None if size is None else (int(size[0]), int(size[1]))}
        card = Card(**{**kept, **sizes, "actions": tuple(kept["actions"])})
        _check(card)
        return card
    except (ValueError, LookupError, TypeError, AttributeError, OverflowError) as fault:
        if isinstance(fault, DeployError):
            raise
        raise DeployError(f"{source}: its metadata cannot be read ({fault}). {EXPORT_AGAIN}") from fault


def _check(card: Card) -> None:
    """Raise ValueError where a value is of another type, or out of bounds; see `Card`."""
    texts = {"scene": card.scene, "kind": card.kind, **{f"action {n}": name for n, name in enumerate(card.actions)}}
    counts = {
        "history_length": (card.history_length, MOST_HISTORY),
        "feature_count": (card.feature_count, MOST_FEATURES),
    }
    for name, side in zip(("height", "width"), card.picture_size or (), strict=False):
        counts[f"the pictures' {name}"] = (side, MOST_SIDE_PX)
    parts = [card.encoder, card.normalisation, card.training, card.settings]
    for name, value in texts.items():
        if not isinstance(value, str):
            raise ValueError(f"{name} is {value!r:.40}")
    for name, (count, most) in counts.items():
        if type(count) is not int or not 1 <= count <= most:
            raise ValueError(f"{name} is {count!r:.40}")
    if len(card.actions) != ACTION_COUNT:
        raise ValueError(f"{len(card.actions)} actions")
    if not isinstance(card.takes_pictures, bool):
        raise ValueError(f"takes_pictures is {card.takes_pictures!r:.40}")
    if not all(isinstance(part, Mapping) for part in (*parts, card.observation or {})):
        raise ValueError("a part of it is no object")
