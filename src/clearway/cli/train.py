"""`clearway train`."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import tyro

from clearway.choices import FeatureStore, ZoneLevel
from clearway.cli.arguments import check_at_least, check_seeds, chosen_targets, scene_files
from clearway.cli.console import say
from clearway.cli.reward import RewardChoice, RewardParameters, chosen_reward
from clearway.learn.config import PRESETS, Algorithm, Learner, PresetName
from clearway.learn.settings import with_settings


@dataclass(frozen=True)
class Train:
    """Train an agent on one or more scenes.

    Example: clearway train bathroom.h5 --reward collision-aware --out runs/bathroom
    """

    files: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Scene files, or folders of them."""
    out: Path
    """The run folder."""
    targets: tuple[str, ...] = ()
    """Target states: "26 37 43" for one scene, "bathroom=26,37 kitchen=90,136" for several. By default the published
    targets for the paper's four scenes, five seeded ones elsewhere."""
    reward: RewardChoice = "collision-aware"
    parameters: RewardParameters = field(default_factory=RewardParameters)
    zones: ZoneLevel = "pose"
    """Whether zones are those of poses or of whole cells."""
    algorithm: Algorithm | None = None
    """ppo, a2c or a3c, instead of the preset's own; a3c goes with the presets paper and paper-a3c."""
    preset: PresetName = "default"
    """default is our recipe; paper is the published settings, synchronous; paper-a3c is the published algorithm."""
    set: tuple[str, ...] = ()
    """Single settings of the learner, for example --set envs=200 clip_rewards=true (all: clearway.learn.config)."""
    frames: int | None = None
    """Training frames, instead of the preset's own."""
    feature_basis: int | None = None
    """Learn from features in so many leading principal directions, instead of the preset's choice; 0: as they are. It
    loses nothing where poses are fewer, and costs quality elsewhere."""
    seed: int = 0
    """Of parameters, environments, actions and the choice of targets."""
    threads: int | None = None
    """Threads of torch, or processes of a3c. Results repeat bit for bit at one number of threads, and a3c's with 1."""
    device: str = "cpu"
    """cpu or cuda."""
    feature_store: FeatureStore = "memory"
    """Where features are kept: memory; float16, in half the memory, rounded; mapped, in a file in the cache folder that
    is gone afterwards, for sets that memory cannot hold. The last two also open large sets faster."""
    resume: bool = False
    """Go on with the run in --out from its newest checkpoint."""

    def run(self) -> None:
        """Train."""
        from clearway.learn.train import RunRequest, set_threads, train
        from clearway.scenes.thor_v1 import read_scene

        check_at_least(1, threads=self.threads)
        check_seeds(seed=self.seed)
        set_threads(self.threads)
        files = scene_files(self.files)
        scenes = [read_scene(path, features_in_file=self.feature_store != "memory") for path in files]
        request = RunRequest(
            scenes=scenes,
            targets=chosen_targets(scenes, self.targets, self.seed),
            learner=self._learner(),
            reward=chosen_reward(self.reward, self.parameters),
            seed=self.seed,
            zone_level=self.zones,
            paths={scene.name: path for scene, path in zip(scenes, files, strict=True)},
            device=self.device,
            feature_store=self.feature_store,
        )
        folder = train(request, self.out, resume=self.resume, show_progress=True)
        rows, count = folder.metrics(), sum(map(len, request.targets.values()))
        if not rows:  # a finished run whose metrics.jsonl was removed
            say(f"{self.out}: trained. Next: clearway evaluate {self.out}")
            return
        solved = int(rows[-1]["solved_targets"])
        each = "" if solved == count else " --targets"
        say(f"{self.out}: trained, {solved} of {count} targets solved. Next: clearway evaluate {self.out}{each}")

    def _learner(self) -> Learner:
        learner = PRESETS[self.preset]
        if self.algorithm == "a2c":
            learner = learner.as_a2c()
        elif self.algorithm is not None:
            learner = replace(learner, algorithm=self.algorithm)
        if self.frames is not None:
            learner = replace(learner, frames=self.frames)
        if self.feature_basis is not None:
            learner = replace(learner, feature_basis=self.feature_basis)
        return with_settings(learner, self.set)
