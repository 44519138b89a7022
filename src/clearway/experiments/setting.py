"""Where experiments happen: scenes written to files, the paper's targets, learners and seeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from urllib.parse import quote

from clearway.choices import LearnerName, ZoneLevel
from clearway.errors import RunError, SceneError
from clearway.experiments.budget import Budget
from clearway.experiments.plan import PlannedRun, SceneFile, TargetSets, Trial
from clearway.learn.learner import Learner
from clearway.learn.presets import DEFAULT, PAPER_A2C, PAPER_A3C
from clearway.learn.settings import with_settings
from clearway.perception import encode_scenes
from clearway.reward import BUMP, COLLISION_AWARE, SHORTEST, Reward, RewardError, reward_named
from clearway.rooms.library import cached_room_scene
from clearway.scenes.digest import scene_digest
from clearway.scenes.parts import is_name
from clearway.scenes.scene import Scene, encoder_names
from clearway.scenes.targets import default_targets, is_published
from clearway.scenes.thor_v1 import read_scene, write_scene
from clearway.world.world import World, make_world

SCENES = "scenes"
LEARNERS: dict[LearnerName, Learner] = {
    "paper": PAPER_A2C,
    "paper-a3c": PAPER_A3C,
    "default": DEFAULT,
    "own-goals": replace(DEFAULT, goals="seen"),
}
ABOUT_LEARNERS: Mapping[str, str] = {
    "paper": "the paper's settings, A2C in place of A3C (PAPER_A2C)",
    "paper-a3c": "the paper's settings and its A3C (PAPER_A3C)",
    "default": "this project's default recipe",
    "own-goals": "the default recipe, which sets itself poses that it has passed as further targets (goals=seen)",
}


TABLE_1_REWARDS: tuple[Reward, ...] = (SHORTEST, BUMP, COLLISION_AWARE)
"""Of the main experiment."""
DEFAULT_REWARDS = tuple(own.name for own in TABLE_1_REWARDS)


@dataclass(frozen=True)
class Setting:
    """What all experiments share.

    Attributes:
        out: folder of the reproduction.
        files, scenes: the scenes, in files and read from them.
        targets: the paper's targets where the scenes are the published ones, else seeded ones.
        budget: see there.
        seeds: of the agents.
        learners: the learners to be compared, by name.
        rewards: to be compared by the experiment `rewards`.
    """

    out: Path
    files: tuple[SceneFile, ...]
    scenes: tuple[Scene, ...]
    targets: TargetSets
    budget: Budget
    seeds: tuple[int, ...]
    learners: Mapping[str, Learner]
    rewards: tuple[Reward, ...] = TABLE_1_REWARDS

    @property
    def original(self) -> bool:
        """The scenes are the ones that the paper used."""
        return all(map(is_published, self.scenes))

    @property
    def encoder(self) -> str:
        """Name of what made the features."""
        return encoder_names(self.scenes)

    def world(self, targets: TargetSets | None = None, zone_level: ZoneLevel = "pose") -> World:
        """The scenes with some targets, the paper's by default."""
        own = self.targets if targets is None else targets
        by_name = {scene.name: chosen for scene, chosen in zip(self.scenes, own, strict=True)}
        return make_world(self.scenes, by_name, zone_level)

    def runs(
        self, learner: Learner, reward: Reward, targets: TargetSets | None = None, frames_factor: float = 1
    ) -> tuple[PlannedRun, ...]:
        """One run a seed; the learner's frames are multiplied by the factor."""
        longer = replace(learner, frames=round(learner.frames * frames_factor))
        own = self.targets if targets is None else targets
        return tuple(PlannedRun(self.files, own, reward, longer, seed) for seed in self.seeds)

    def trial(
        self, targets: TargetSets | None = None, *, halfway: bool = False, step_limit: int | None = None
    ) -> Trial:
        """The protocol on some targets, the paper's by default; of the agent halfway, or in the end.

        `step_limit` ends episodes sooner than the budget does.
        """
        own, limit = self.targets if targets is None else targets, self.budget.step_limit
        return Trial(
            own, halfway, self.budget.episodes_per_target, limit if step_limit is None else min(limit, step_limit)
        )


def prepare(
    out: Path,
    budget: Budget,
    *,
    dumps: Sequence[Path] = (),
    encoder: str,
    seeds: int | None = None,
    first_seed: int = 0,
    learners: Sequence[LearnerName],
    rewards: Sequence[str] = DEFAULT_REWARDS,
    changes: Sequence[str] = (),
    build: bool = True,
    show_progress: bool = False,
) -> Setting:
    """The setting of a reproduction; default rooms are built, encoded and written to `out` the first time.

    Args:
        out: folder of the reproduction.
        budget: see there.
        dumps: scene files with features, such as the published ones; none: the default rooms.
        encoder: for the default rooms.
        seeds: how many; None: as the budget says.
        first_seed: of them; the others follow it.
        learners: names among `LEARNERS`.
        rewards: names, see `reward_named`.
        changes: of settings of every learner, such as "lr_start=0.002".
        build: False refuses default rooms that are not there yet.
        show_progress: draw progress bars.

    Raises:
        SceneError: a dump cannot be read or has no features; or a room is not there, and none is to be built.
        RunError: as of `changed_learners`.
        ClearwayError: as of `named_rewards`.
    """
    compared = named_rewards(rewards)
    own = changed_learners(learners, budget, changes)
    paths = list(dumps)[: budget.most_scenes] if dumps else _room_files(out, budget, encoder, build, show_progress)
    scenes = tuple(read_scene(path) for path in paths)
    for scene, path in zip(scenes, paths, strict=True):
        if scene.features is None:
            raise SceneError(path, "the scene has no features", "Encode it first, with clearway scenes import")
    return Setting(
        out=out,
        files=tuple(
            SceneFile(scene.name, path.resolve(), scene_digest(scene))
            for scene, path in zip(scenes, paths, strict=True)
        ),
        scenes=scenes,
        targets=tuple(default_targets(scene) for scene in scenes),
        budget=budget,
        seeds=tuple(range(first_seed, first_seed + (budget.seeds if seeds is None else seeds))),
        learners=own,
        rewards=compared,
    )


def named_rewards(names: Sequence[str]) -> tuple[Reward, ...]:
    """Rewards that are compared by their names.

    Raises:
        ClearwayError: there is no such reward, it cannot be imported, or two are called alike.
        RewardError: a reward's own name can be no part of the name of its runs' folders.
    """
    found = {reward.name: reward for reward in map(reward_named, names)}
    if odd := [name for name in found if not is_name(name)]:
        problem = f"reward {odd[0]!r:.80}: its name is part of folders' names"
        raise RewardError(f"{problem}. Give a short one without slashes and line breaks")
    if len(found) < len(names):
        raise RewardError(f"rewards {', '.join(names)}: two are called alike, of {', '.join(found)}. Rename one")
    return tuple(found.values())


def changed_learners(names: Sequence[LearnerName], budget: Budget, changes: Sequence[str]) -> dict[str, Learner]:
    """The named learners, with the budget's frames and changed settings.

    Raises:
        RunError: a change is none that every learner could make, or is one of frames, which are the budget's.
    """
    for change in changes:
        if change.partition("=")[0] == "frames":
            raise RunError(f"--set {change}: frames are the budget's. Give --frames")
    return {name: with_settings(_budgeted(name, budget), changes, name) for name in names}


def _room_files(out: Path, budget: Budget, encoder: str, build: bool, show_progress: bool) -> list[Path]:
    """The default rooms with features, in files under `out`.

    A folder for each encoder and set of rooms: a random encoder is calibrated on all of them, so that the features of
    one room are others beside others.
    """
    folder = out / SCENES / quote(encoder, safe="") / "+".join(budget.rooms)
    paths = [folder / f"{name}.h5" for name in budget.rooms]
    missing = [path for path in paths if not path.exists()]
    if missing and not build:
        remedy = "Unpack the record that holds its rooms, too; clearway reproduce builds others, and trains anew"
        raise SceneError(missing[0], "this room of the reproduction is not there", remedy)
    if missing:
        rooms = [cached_room_scene(name, progress=show_progress) for name in budget.rooms]
        for scene, path in zip(encode_scenes(rooms, encoder, progress=show_progress), paths, strict=True):
            write_scene(scene, path)
    return paths


def _budgeted(name: LearnerName, budget: Budget) -> Learner:
    frames = budget.default_frames if name in ("default", "own-goals") else budget.frames
    return LEARNERS[name] if frames is None else replace(LEARNERS[name], frames=frames)
