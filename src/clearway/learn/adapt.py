"""Adapting the generalist to scenes: the paper's network begins with what the generalist's walks have shown.

    walks      the generalist tours every scene and walks to the targets (`guided_walks`); its steps are frames
    lessons    the network walks in its mind, from pose to pose as steps were seen to lead (`mind_walks`), and learns
               which actions are best under the reward, by exact planning in the steps seen, and what they are worth
    then       all environments walk a rollout under the network's policy, which shows more steps, and lessons follow

Nothing of a scene is used but its pictures, where steps were seen to lead, and what they earned. Poses are told apart
by their pictures, as look-ahead does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

from clearway.errors import RunError
from clearway.learn.learner import AT_LEAST_ONE, Learner
from clearway.learn.ppo import PPO

if TYPE_CHECKING:
    from collections.abc import Sequence

    from torch import Tensor

    from clearway.learn.adapting import AdaptingTrainer
    from clearway.reward import Reward
    from clearway.scenes.scene import Scene
    from clearway.world.world import World

AT_LEAST_ONE |= {"tour_steps", "walks", "walk_steps", "lessons", "mind_walks", "mind_steps"}


@dataclass(frozen=True)
class Adapt(PPO):
    """The generalist adapted. Network, rollouts, minibatches and optimiser are as PPO's settings say.

    What they say of returns, hindsight, look-ahead and ratios plays no part.
    """

    algorithm: ClassVar[str] = "adapt"
    sees_takes: ClassVar[bool] = False

    frames: int = 40_000
    """The generalist's and all environments' steps; schedules end here."""
    entropy_start: float = 2e-3
    source: Literal["generalist"] = "generalist"
    """What is adapted."""
    tour_steps: int = 300
    """Of the generalist's tour of each scene."""
    walks: int = 2
    """Of the generalist to each target, from random starts."""
    walk_steps: int = 40
    """Steps after which such a walk is over."""
    lessons: int = 8
    """After the generalist's walks, and after every rollout."""
    mind_walks: int = 400
    """Walks side by side in mind."""
    mind_steps: int = 10
    """Steps of each of them for a lesson."""

    def trainer(self, world: World, reward: Reward, seed: int) -> AdaptingTrainer:
        """A trainer at its first frame.

        Raises:
            RunError: the scenes' features are not those of the generalist's eyes, or it shall have goals of its own.
            SceneError: it cannot walk by the scenes' moves.
        """
        from clearway.agents.generalist import Generalist
        from clearway.learn.adapting import AdaptingTrainer

        if self.goals != "given":
            raise RunError(
                f"adapt learns given targets alone, not goals={self.goals}. Leave goals out, or train by ppo"
            )
        generalist = Generalist.shipped().stepping(world.steps)
        eyes = generalist.encoder.record
        if world.features is None or world.encoder is None or world.encoder.identity != eyes.identity:
            seen = "have none" if world.features is None else "have those of another encoder"
            raise RunError(
                f"the generalist goes by features of its own eyes, and the scenes {seen}. Encode them, which needs "
                f"pictures: clearway scenes encode FILE --encoder {eyes.name} --out FILE"
            )
        return AdaptingTrainer(world, self, reward, seed, generalist)

    def check_workers(self, states: Tensor) -> None:
        """Raise RunError: the generalist's walks, and lessons in what they have shown, are for one worker."""
        Learner.check_workers(self, states)

    def warn_of(self, scenes: Sequence[Scene]) -> None:
        """Warn (AspectWarning) of pictures of another aspect than those that the generalist's eyes were taught on."""
        from clearway.agents.generalist import Generalist

        Generalist.shipped().warn_of_aspect(scenes)
