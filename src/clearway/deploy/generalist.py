"""`GeneralistAgent`: the agent for any room behind a camera, with its card; its eyes run on PyTorch, or by a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from clearway.agents.agent import Agent, Decisions, Observation, State
from clearway.agents.exploring import Explorer
from clearway.agents.generalist import STEPS_M, Generalist
from clearway.agents.tour_map import map_of
from clearway.choices import GENERALIST
from clearway.deploy.card import ANY_ROOM, EXPORT_AGAIN, Card
from clearway.deploy.onnx_eyes import OnnxEyes
from clearway.deploy.onnx_file import OnnxFile
from clearway.errors import DeployError
from clearway.mapping.map_files import read_map, write_map
from clearway.mapping.room_map import RoomMap
from clearway.mapping.settings import MappingSettings
from clearway.perception.token_grid import TokenGrid
from clearway.scenes.actions import ACTION_NAMES
from clearway.scenes.scene import EncoderRecord
from clearway.scenes.sensors import rgb
from clearway.version import __version__

MOST = 1e6  # of a setting
BOUNDS = {"step_m": STEPS_M, "side_m": (1.0, 60.0), "compared": (1, 1000), "arrived": (0.0, 1.0)}
TOUR_PICTURES = 500  # that a tour keeps; further ones tell of cells, and are forgotten


class GeneralistAgent:
    """The generalist, see `DeployedAgent`; and who tours rooms for it.

    Args:
        generalist: by its eyes.
        card: what its file says; None: what it is.
    """

    def __init__(self, generalist: Generalist, card: Card | None = None) -> None:
        self.generalist = generalist
        self._agent = generalist.behind_camera()
        self.sees: tuple[str, ...] = self._agent.sees
        self.card: Card = card or card_of(generalist)

    def reset(self, target: Observation, seed: np.ndarray) -> State:
        """See `Agent.reset`."""
        return self._agent.reset(target, seed)

    def act(self, observation: Observation, state: State) -> tuple[Decisions, State]:
        """See `Agent.act`."""
        return self._agent.act(observation, state)

    def explorer(self) -> Explorer:
        """Who tours a room."""
        return self.generalist.explorer(TOUR_PICTURES, camera=True)

    def map_of(self, state: State) -> RoomMap:
        """What a tour has found, by the explorer's state."""
        return map_of(state, self.generalist.sight, self.generalist.settings)

    def knowing(self, known: RoomMap) -> Agent:
        """The agent in the room of a map."""
        return self.generalist.behind_camera(known)

    def write_map(self, path: Path, known: RoomMap) -> None:
        """See `map_files.write_map`."""
        write_map(path, known, self._eyes, self.generalist.settings.step_m)

    def read_map(self, path: Path) -> RoomMap:
        """See `map_files.read_map`."""
        return read_map(path, self._eyes, self.generalist.settings.step_m, self.card.feature_count)

    @property
    def _eyes(self) -> str:
        return self.generalist.encoder.record.identity


def card_of(generalist: Generalist) -> Card:
    """What a generalist is."""
    record, (height, width) = generalist.encoder.record, generalist.picture_px
    resize = "bilinear, antialiased, the whole picture"
    lens = {"vertical_fov_deg": TokenGrid().vertical_fov_deg}
    return Card(
        scene=ANY_ROOM,
        actions=ACTION_NAMES,
        history_length=1,
        feature_count=generalist.sight.feature_count,
        takes_pictures=True,
        encoder={"name": record.name, "identity": record.identity, "settings": dict(record.settings)},
        normalisation={"pixels": {"resize": resize, "height": height, "width": width}},
        picture_size=(height, width),
        training={"versions": {"clearway": __version__}},
        observation={**rgb(height, width).to_json(), **lens},
        kind=GENERALIST,
        settings=asdict(generalist.settings),
    )


def exported_generalist(file: OnnxFile) -> GeneralistAgent:
    """The generalist of an exported file, on onnxruntime.

    Raises:
        DeployError: its card does not fit this clearway.
    """
    card = file.card
    try:
        shape: Any = card.encoder["settings"]
        description_width = int(shape["shape"]["description_width"])
        settings = _settings(card.settings)
        record = EncoderRecord(str(card.encoder["name"]), str(card.encoder["identity"]), dict(shape))
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as fault:
        problem = f"{file.source}: its card is not one of a generalist of clearway {__version__} ({fault})"
        raise DeployError(f"{problem}. {EXPORT_AGAIN}") from fault
    eyes = OnnxEyes(file, record, description_width)
    return GeneralistAgent(Generalist(eyes, eyes, settings), card)


def _settings(given: Mapping[str, Any]) -> MappingSettings:
    """Raises TypeError or ValueError where they are no settings."""
    usual = asdict(MappingSettings())
    if given.keys() != usual.keys():
        raise ValueError(f"settings {', '.join(sorted(given.keys() ^ usual.keys()))}")
    for name, value in usual.items():
        if type(given[name]) is not type(value):
            raise ValueError(f"{name} is {given[name]!r:.40}")
        low, high = BOUNDS.get(name, (-MOST, MOST))
        if not low <= given[name] <= high:  # nor is NaN
            raise ValueError(f"{name} is {given[name]}, expected {low:g} to {high:g}")
    return MappingSettings(**given)
