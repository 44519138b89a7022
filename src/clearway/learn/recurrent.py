"""A recurrent agent for all rooms: taught by the exact planner first, then by reward (PPO).

Taught: the agent walks by its own choice, or by the teacher's with a share that falls to nothing; in every pose that it
comes to it learns the set of best actions (DAgger: Ross, Gordon & Bagnell, AISTATS 2011),

    L = mean( -log sum_{a best} pi(a) ),

through what it remembers, over T steps. Teaching alone dithers: it averages over what cannot be seen. So the rest of
the frames are PPO's (Schulman et al., 2017) with the same memory.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from torch import Tensor

from clearway.agents.recurrent import RecurrentAgent
from clearway.errors import RunError
from clearway.learn.described import described
from clearway.learn.learner import Learner
from clearway.learn.named_tensors import part_of
from clearway.learn.recurrent_trainer import RecurrentTrainer
from clearway.model.recurrent import RecurrentActorCritic, RecurrentShape, SeenPairs
from clearway.perception import eyes
from clearway.perception.encode import encoded
from clearway.perception.eyes import EyesEncoder
from clearway.reward import Reward
from clearway.scenes.aspect import warn_of_aspect
from clearway.scenes.scene import EncoderRecord, Scene
from clearway.world.world import World

if TYPE_CHECKING:
    from clearway.learn.run_record import RunRecord


@dataclass(frozen=True)
class Recurrent(Learner):
    """The settings."""

    algorithm: ClassVar[str] = "recurrent"
    sees_takes: ClassVar[bool] = True

    frames: int = 12_000_000
    """Training frames over all environments; schedules end here."""
    taught: float = 0.5
    """Share of the frames in which the planner teaches; the rest is PPO's."""
    envs: int = 384
    """Environments side by side."""
    rollout_steps: int = 32
    """Steps of every environment between updates, through which errors go back."""
    step_limit: int = 200
    """Steps after which a training episode is cut."""
    width: int = 256
    """Of the network."""
    remembers: bool = True
    """False: forget at every step what came before the last one, to see what memory brings."""
    discount: float = 0.99
    gae_lambda: float = 0.95
    teacher_share: float = 0.5
    """Of the steps that are the teacher's at the start; it falls to nothing when teaching is done."""
    taught_lr_start: float = 1e-3
    taught_lr_end: float = 1e-4
    lr_start: float = 3e-4
    lr_end: float = 3e-5
    """Adam's learning rates fall geometrically from start to end, in each part."""
    epochs: int = 2
    """Passes over each rollout of PPO; where it is taught there is one."""
    minibatches: int = 4
    """Groups of environments in a pass."""
    ratio_clip: float = 0.2
    entropy_start: float = 5e-3
    entropy_end: float = 5e-4
    clip_norm: float = 0.5
    """Largest norm of the gradient."""

    def __post_init__(self) -> None:
        """Refuse settings that cannot work; see `Learner`."""
        super().__post_init__()
        for name in ("taught", "teacher_share"):
            if not 0 <= getattr(self, name) <= 1:
                raise RunError(f"{name} is {getattr(self, name)}, expected 0 to 1. Give a value in that range")
        for name in ("taught_lr_start", "taught_lr_end", "lr_end"):
            if not getattr(self, name) > 0:
                raise RunError(
                    f"{name} is {getattr(self, name)}, expected above 0, as rates fall geometrically. Give a small rate"
                )

    @property
    def heads_by_scene(self) -> bool:
        """The network is the same in every scene."""
        return False

    @property
    def taught_frames(self) -> int:
        """Frames in which the planner teaches."""
        return round(self.taught * self.frames)

    def shape(self, pair_count: int) -> RecurrentShape:
        """Sizes of its network, for so many numbers of a pair."""
        return RecurrentShape(pair_count, self.width, self.remembers)

    def trainer(self, world: World, reward: Reward, seed: int) -> RecurrentTrainer:
        """A trainer at its first frame. Raises RunError where the scenes are not seen by eyes."""
        if world.encoder is None or world.encoder.settings.get("kind") != eyes.KIND:
            seen = "have no features" if world.encoder is None else f"are encoded by {world.encoder.name}"
            problem = f"algorithm {self.algorithm} compares pictures by eyes, and the scenes {seen}"
            raise RunError(f"{problem}. Encode them with --encoder clearway, or a folder that clearway pretrain made")
        return RecurrentTrainer(world, self, reward, seed, eyes.from_record(world.encoder).eyes)

    def warn_of(self, scenes: Sequence[Scene]) -> None:
        """Warn (AspectWarning) where pictures have another aspect than those that the scenes' eyes were taught on."""
        by_eyes: dict[tuple[int, int], list[Scene]] = defaultdict(list)
        for scene in scenes:
            if scene.encoder is not None and scene.encoder.settings.get("kind") == eyes.KIND:
                by_eyes[eyes.card_of(scene.encoder).shape.picture_px].append(scene)
        for picture_px, own in by_eyes.items():
            warn_of_aspect(own, picture_px)

    def agent(self, record: RunRecord, tensors: Mapping[str, Tensor], frames: int) -> TrainedRecurrent:
        """The agent of a run from the tensors of its checkpoint; see `Learner.agent`."""
        pairs = SeenPairs.from_tensors(part_of(tensors, "pairs"))
        network = RecurrentActorCritic(self.shape(pairs.count))
        network.load_state_dict(part_of(tensors, "network"))
        return TrainedRecurrent(record, network, pairs, frames)


@dataclass(frozen=True)
class TrainedRecurrent:
    """A trained agent with what it needs to act.

    Attributes:
        record: of its run.
        network: the parameters.
        pairs: compares what is seen with the target.
        frames: it has learnt from.
        tries_again: it may try again what was blocked where it sees the very same picture, see `RecurrentAgent`.
    """

    record: RunRecord
    network: RecurrentActorCritic
    pairs: SeenPairs
    frames: int
    tries_again: bool = False

    def __repr__(self) -> str:
        return described(self)

    def on_poses(self, world: World) -> RecurrentAgent:
        """Its agent on the grid: it goes by features, in any world of the same eyes."""
        return RecurrentAgent(self.network, self.pairs, tries_again=self.tries_again)

    def behind_camera(self) -> RecurrentAgent:
        """Its agent that sees pictures, in any room."""
        return RecurrentAgent(self.network, self.pairs, self.encoder, tries_again=self.tries_again)

    @property
    def encoder(self) -> EyesEncoder:
        """Its own eyes."""
        return EyesEncoder(EncoderRecord(eyes.NAME, "of the run", {}), self.pairs.eyes)

    def warn_of_aspect(self, scenes: Sequence[Scene]) -> None:
        """Warn (AspectWarning) where pictures have another aspect than those that the eyes were taught on."""
        warn_of_aspect(scenes, self.pairs.eyes.shape.picture_px, stacklevel=3)

    def seen(self, scenes: Sequence[Scene]) -> list[Scene]:
        """Any scenes with pictures as its own eyes see them.

        Raises:
            EncoderError: a scene has no pictures.

        Warns:
            AspectWarning: a scene's pictures have another aspect than those that the eyes were taught on.
        """
        self.warn_of_aspect(scenes)
        return [encoded(scene, self.encoder) for scene in scenes]
