"""An experiment's setting in a small room that can be walked in."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from clearway.experiments.plan import SceneFile
from clearway.experiments.setting import Setting
from clearway.learn.presets import PAPER_A2C
from clearway.live.live_room import LiveRoom
from clearway.scenes.digest import scene_digest
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import read_scene, write_scene
from helpers.small_runs import small_learner
from helpers.small_setting import BUDGET, FRAMES

ORIGIN_M = (9.65, -15.85)
"""Where the room's corner lies in the coordinates of the scene's file, as of a floor plan."""


def live_setting(folder: Path, live: LiveRoom, monkeypatch: pytest.MonkeyPatch, seeds: int = 5) -> Setting:
    """One small room of ours, some seeds of a learner that finishes in a blink, two episodes to each target."""
    path = folder / "walkable.h5"
    write_scene(replace(live.scene, locations_m=live.scene.locations_m + ORIGIN_M), path)
    scene = read_scene(path)

    def in_room(scene: Scene) -> LiveRoom:
        return replace(live, scene=replace(scene, locations_m=scene.locations_m - ORIGIN_M), origin_m=ORIGIN_M)

    monkeypatch.setattr("clearway.live.walks.live_room", in_room)
    return Setting(
        out=folder,
        files=(SceneFile(scene.name, path, scene_digest(scene)),),
        scenes=(scene,),
        targets=((5, 40),),
        budget=replace(BUDGET, episodes_per_target=2),
        seeds=tuple(range(seeds)),
        learners={"paper": small_learner(PAPER_A2C, frames=FRAMES)},
    )
