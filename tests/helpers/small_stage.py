"""Small agents and three scenes for the tests of the viewer; one has depth, one twelve headings and no pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clearway.importers.pose_graph import recorded_pose_graph
from clearway.learn.train import train
from clearway.reward import COLLISION_AWARE, SHORTEST, Reward
from clearway.scenes.scene import EncoderRecord, Provenance, Scene
from clearway.scenes.thor_v1 import write_scene
from clearway.view.stage import Stage, run_stage
from helpers.made import made_up_features, with_depth
from helpers.small_runs import FEATURES, small_learner, small_request, small_scenes, small_targets

L_SHAPE = np.array([[0, 0], [0, 1], [0, 2], [1, 2], [2, 2]])
BARE_TARGETS = (2, 30)
HEADINGS = 12


def bare_scene() -> Scene:
    """An L of five cells with twelve headings, no pictures and no picture from above."""
    locations_m = np.repeat(L_SHAPE, HEADINGS, axis=0) * 0.5
    headings_deg = np.tile(np.arange(HEADINGS) * 360 // HEADINGS, len(L_SHAPE))
    return Scene(
        name="bare",
        observations=None,
        features=made_up_features(locations_m, headings_deg, FEATURES),
        locations_m=locations_m,
        headings_deg=headings_deg,
        graph=recorded_pose_graph(locations_m, headings_deg.astype(float), 0.5, source="bare"),
        made_by=Provenance("test"),
        encoder=EncoderRecord("made-up", f"made-up-{FEATURES}", {"feature_count": FEATURES}),
    )


def stage_scenes() -> list[Scene]:
    """A corridor with depth, a grid and the bare L."""
    corridor, *others = small_scenes()
    return [with_depth(corridor), *others, bare_scene()]


def write_scenes(folder: Path, scenes: list[Scene] | None = None) -> list[Path]:
    """Their files."""
    paths = []
    for scene in stage_scenes() if scenes is None else scenes:
        paths.append(folder / f"{scene.name}.h5")
        write_scene(scene, paths[-1])
    return paths


def small_agent(
    folder: Path, reward: Reward = COLLISION_AWARE, seed: int = 3, scenes: list[Scene] | None = None
) -> Path:
    """A run of an instant; returns its folder."""
    shown = stage_scenes() if scenes is None else scenes
    targets = small_targets() | {"bare": BARE_TARGETS}
    learner = small_learner(frames=160)
    request = small_request(
        scenes=shown, targets={s.name: targets[s.name] for s in shown}, learner=learner, reward=reward, seed=seed
    )
    return train(request, folder).path


def small_stage(folder: Path) -> Stage:
    """Two agents, `aware` and `plain`, that share three scenes."""
    runs = [small_agent(folder / "aware"), small_agent(folder / "plain", SHORTEST, seed=4)]
    return run_stage(runs, write_scenes(folder))
