"""Small random eyes, and scenes seen by them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from clearway.agents.agent import Agent
from clearway.agents.generalist import Generalist
from clearway.agents.recurrent import RecurrentAgent
from clearway.mapping.settings import MappingSettings
from clearway.model.recurrent import RecurrentActorCritic, RecurrentShape, SeenPairs
from clearway.perception import encode_scenes
from clearway.perception.eyes import find_record, from_record, write_eyes
from clearway.perception.eyes_network import Eyes, EyesShape
from clearway.scenes.scene import Scene
from clearway.world.world import World

SMALL = EyesShape(widths=(8, 8, 8), token_width=4, description_width=16, hidden_width=16, height_px=48, width_px=64)


def small_eyes(seed: int = 0, shape: EyesShape = SMALL) -> Eyes:
    """Eyes that have learnt nothing."""
    with torch.random.fork_rng(devices=()):
        torch.manual_seed(seed)
        made = Eyes(shape)
        for module in made.modules():
            if isinstance(module, torch.nn.BatchNorm2d):
                torch.nn.init.uniform_(module.running_mean, -0.1, 0.1)
                torch.nn.init.uniform_(module.running_var, 1e-6, 2.0)
    return made


def seen_by_eyes(folder: Path, *scenes: Scene, seed: int = 0) -> list[Scene]:
    """The scenes with features of small eyes, which are written to a folder."""
    write_eyes(folder, small_eyes(seed), {})
    return encode_scenes([replace(scene, features=None, encoder=None) for scene in scenes], str(folder), threads=1)


def small_generalist(folder: Path) -> Generalist:
    """A generalist by the small eyes in a folder, on a small lattice; it walks, and knows little of where."""
    return replace(Generalist.by_eyes(from_record(find_record(str(folder)))), settings=MappingSettings(side_m=7.0))


def ship(generalist: Generalist, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let this one be the shipped generalist."""
    monkeypatch.setattr(Generalist, "shipped", classmethod(lambda cls: generalist))


def recurrent(world: World, *, remembers: bool = True, tries_again: bool = False) -> Agent:
    """One that has learnt nothing, by eyes whose features are as many as the world's."""
    pairs = SeenPairs(small_eyes(0, EyesShape((4, 4, 4), 4, 4, 8, height_px=16, width_px=32)))
    assert world.features is not None and world.features.shape[1] == 4 + 2 * 4
    network = RecurrentActorCritic(RecurrentShape(pairs.count, 8, remembers))
    return RecurrentAgent(network, pairs, tries_again=tries_again)
