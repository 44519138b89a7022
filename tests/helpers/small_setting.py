"""The setting of experiments on two small scenes, with learners that finish in a blink."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from clearway.experiments.budget import SMOKE
from clearway.experiments.job import do
from clearway.experiments.plan import Job, SceneFile
from clearway.experiments.setting import Setting
from clearway.learn.presets import DEFAULT, PAPER_A2C
from clearway.scenes.digest import scene_digest
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import read_scene, write_scene
from helpers.made import grid_scene
from helpers.small_runs import FEATURES, small_learner

PRESETS = {"paper": PAPER_A2C, "default": DEFAULT}
FRAMES = 160  # two updates
BUDGET = replace(SMOKE, default_frames=2_400, episodes_per_target=3, step_limit=40)


def small_rooms() -> list[Scene]:
    """Two grids, large enough for the experiments' targets."""
    return [
        grid_scene(seed, width=4, depth=4, obstacle_share=0.1, feature_count=FEATURES, name=name)
        for seed, name in ((1, "bathroom"), (2, "kitchen"))
    ]


def small_setting(out: Path, seeds: int = 2) -> Setting:
    """Both learners on two small rooms, three targets in one and two in the other."""
    paths = []
    for scene in small_rooms():
        path = out / "scenes" / f"{scene.name}.h5"
        path.parent.mkdir(parents=True, exist_ok=True)
        write_scene(scene, path)
        paths.append(path)
    scenes = tuple(read_scene(path) for path in paths)
    return Setting(
        out=out,
        files=tuple(SceneFile(s.name, p, scene_digest(s)) for s, p in zip(scenes, paths, strict=True)),
        scenes=scenes,
        targets=((0, 13, 30), (5, 22)),
        budget=BUDGET,
        seeds=tuple(range(seeds)),
        learners={name: small_learner(preset, frames=FRAMES) for name, preset in PRESETS.items()},
    )


def do_here(out: Path, jobs: Sequence[Job], *, threads: int, **_: object) -> None:
    """What `run_jobs` does, without processes of its own."""
    for job in jobs:
        do(out, job, threads)
