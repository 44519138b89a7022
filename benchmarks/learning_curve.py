"""Train one agent and look at it now and then, with the clock stopped: its learning curve against the criteria."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass

from clearway.agents.by_pose import PoseAgent, network_on_poses
from clearway.evaluation.criteria import Criteria, Quality, quality
from clearway.evaluation.episodes import run_episodes
from clearway.evaluation.metrics import SC_STEPS, by_target
from clearway.evaluation.summary import Evaluation, Protocol, summarise
from clearway.learn.learner import OnFeatures
from clearway.learn.named_tensors import part_of
from clearway.learn.running import Learning
from clearway.learn.train import RunRequest
from clearway.model.feature_map import FeatureMap
from clearway.model.lookup import LookupNetwork
from clearway.model.network import NetworkShape, SiameseActorCritic

CHECK_SEED, FINAL_SEED = 1, 0  # of starts and chances; other episodes at the end than during training
CRITERIA = Criteria()
CRITERION_NAMES = ("solved_targets", "path_ratio", "worst_path_ratio", "collisions", "all")


@dataclass(frozen=True)
class Check:
    """The agent after some training."""

    frames: int
    seconds: float
    quality: Quality

    def to_json(self) -> dict[str, object]:
        """A row of the curve."""
        return {"frames": self.frames, "seconds": self.seconds, **self.quality.to_json()}


@dataclass(frozen=True)
class Curve:
    """A training run.

    Attributes:
        seed: of the run.
        checks: during training, the last when it has ended.
        evaluation, quality: at the end, by the whole protocol.
        seconds, frames: of training.
    """

    seed: int
    checks: tuple[Check, ...]
    evaluation: Evaluation
    quality: Quality
    seconds: float
    frames: int

    def first(self, criterion: str) -> Check | None:
        """The first check at which a criterion is met (see `Quality.met`); None: at no check."""
        return next((check for check in self.checks if check.quality.met(CRITERIA)[criterion]), None)

    def to_json(self) -> dict[str, object]:
        """All of it as JSON values."""
        first = {name: self.first(name) for name in CRITERION_NAMES}
        return {
            "seed": self.seed,
            "frames": self.frames,
            "seconds": self.seconds,
            **self.quality.to_json(),
            "met": self.quality.met(CRITERIA),
            "first_met": {
                name: check and {"frames": check.frames, "seconds": check.seconds} for name, check in first.items()
            },
            "checks": [check.to_json() for check in self.checks],
            "evaluation": self.evaluation.to_json(),
        }


def learning_curve(
    request: RunRequest,
    encoder: str,
    *,
    every_frames: int,
    check_episodes: int,
    final: Protocol,
    show: Callable[[Check], None],
) -> Curve:
    """Train until all frames are used.

    Args:
        request: what to train; seconds count making the trainer and its updates.
        encoder: name of what made the features.
        every_frames: between checks.
        check_episodes: a target, for a check; they fail after 500 steps.
        final: protocol of the evaluation at the end.
        show: called with every check.
    """
    checks: list[Check] = []
    since = time.perf_counter()
    with closing(request.trainer()) as trainer:
        seconds, due = time.perf_counter() - since, every_frames
        while not trainer.finished:
            since = time.perf_counter()
            trainer.update()
            seconds += time.perf_counter() - since
            if trainer.frames >= due or trainer.finished:
                checks.append(Check(trainer.frames, seconds, _checked(trainer, check_episodes)))
                show(checks[-1])
                due += every_frames * ((trainer.frames - due) // every_frames + 1)
        table = run_episodes(
            trainer.world,
            agent_of(trainer),
            episodes_per_target=final.episodes_per_target,
            step_limit=final.step_limit,
            seed=final.seed,
        )
        evaluation = summarise(trainer.world, table, request.reward.name, encoder, final)
        found = quality(trainer.world, by_target(table, trainer.world.target_count))
        return Curve(request.seed, tuple(checks), evaluation, found, seconds, trainer.frames)


def _checked(trainer: Learning, episodes: int) -> Quality:
    table = run_episodes(
        trainer.world,
        agent_of(trainer),
        episodes_per_target=episodes,
        step_limit=SC_STEPS,
        seed=CHECK_SEED,
    )
    return quality(trainer.world, by_target(table, trainer.world.target_count))


def agent_of(trainer: Learning) -> PoseAgent:
    """The agent as it stands, whichever algorithm trains it; training is none the wiser."""
    world, learner = trainer.world, trainer.learner
    assert world.features is not None and isinstance(learner, OnFeatures)
    feature_map = FeatureMap.from_tensors(part_of(trainer.fixed_tensors(), "features"))
    heads = learner.head_count(world.scene_count)
    shape = NetworkShape(heads, feature_map.input_count, learner.width, learner.history_length)
    network = SiameseActorCritic(shape).to(world.device)
    network.load_state_dict(part_of(trainer.tensors(), "network"))
    lookup = LookupNetwork(network, feature_map(world.features), world.target_state)
    return network_on_poses(lookup, world, learner.reward_scale)
