"""The demo on a made-up room with a tiny network, for tests."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import pytest
from PIL import Image

from clearway.evaluation.runs import evaluate_runs
from clearway.examples.contrast import FILE
from clearway.scenes.scene import Scene
from clearway.viz.page import KeyFigure, Opening, Picture
from helpers.made import grid_scene
from helpers.small_pictures import shrink_pictures
from helpers.small_runs import FEATURES, small_learner

ROOM_CELLS = (4, 3)


def small_bathroom() -> Scene:
    """What stands in for the bathroom; its features are there already."""
    width, depth = ROOM_CELLS
    return grid_scene(1, width=width, depth=depth, obstacle_share=0.1, feature_count=FEATURES, name="bathroom")


def still(out: Path) -> Opening:
    """A picture in place of the films that a page begins with."""
    file = FILE.format("shortest")
    (out / file).parent.mkdir()
    Image.new("RGB", (8, 6)).save(out / file)
    return Opening([KeyFigure("shortest: collisions an episode", "0.1")], [Picture(file, "The example", "an agent")])


def shrink_demo(patch: pytest.MonkeyPatch) -> None:
    """Let the demo take the small room as it is, learn with few environments, walk few, short episodes, draw small."""

    def room(name: str, *, progress: bool) -> Scene:
        assert name == "bathroom"
        return small_bathroom()

    def encode(scenes: Sequence[Scene], encoder: str, *, progress: bool) -> list[Scene]:
        return list(scenes)

    shrink_pictures(patch)
    patch.setattr("clearway.examples.contrast.contrast", still)
    patch.setattr("clearway.experiments.demo_generalist.STEP_LIMIT", 40)
    patch.setattr("clearway.experiments.demo.cached_room_scene", room)
    patch.setattr("clearway.experiments.demo.encode_scenes", encode)

    def chosen(seed: int) -> Scene:
        return grid_scene(seed, width=4, depth=3, obstacle_share=0.1, name=f"room-{seed}")

    patch.setattr("clearway.experiments.demo_generalist.room_of_seed", chosen)
    patch.setattr("clearway.experiments.demo.DEFAULT", small_learner())
    brief = partial(evaluate_runs, episodes_per_target=5, step_limit=60)
    patch.setattr("clearway.experiments.demo.evaluate_runs", brief)
