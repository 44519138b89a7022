"""Seconds of training until every target is solved, ours and Stable-Baselines3's PPO, for peers.py."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any

from sb3 import SiamesePolicy, network_settings, policy_of, vec_env
from scene_sets import ON_PREPARED, prepared, world_of
from solving import SolvingClock
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from throughput import ENDLESS

from clearway.agents.agent import Agent
from clearway.agents.by_pose import network_on_poses
from clearway.learn.presets import DEFAULT
from clearway.learn.trainer import Trainer
from clearway.model.lookup import LookupNetwork
from clearway.model.network import SiameseActorCritic
from clearway.reward import COLLISION_AWARE
from clearway.scenes.scene import Scene
from clearway.world.world import World


@dataclass(frozen=True)
class Outcome:
    """Training until every target is solved, or time or frames are used up.

    Attributes:
        agent, seed: of the run.
        seconds, frames: of training.
        out_of: what ended it unsolved, "time" or "frames"; None where all is solved.
        solved, targets: how many of how many, at the end.
    """

    agent: str
    seed: int
    seconds: float
    frames: int
    out_of: str | None
    solved: int
    targets: int


def outcome(agent: str, seed: int, frames: int, clock: SolvingClock) -> Outcome:
    """What the clock says at the end."""
    targets = clock.world.target_count
    solved = targets if clock.solved else clock.solved_count()
    out_of = None if solved == targets else "time" if clock.out_of_time else "frames"
    return Outcome(agent, seed, clock.seconds, frames, out_of, solved, targets)


def our_outcome(world: World, seed: int, cap_s: float) -> Outcome:
    """Our default learner."""
    trainer = Trainer(world, ON_PREPARED, COLLISION_AWARE, seed)

    def current() -> Agent:
        trainer.lookup.refresh()
        return network_on_poses(trainer.lookup, world)

    clock = SolvingClock(world, current, cap_s)
    clock.start()
    over = False
    while not over and not trainer.finished:
        trainer.update()
        over = clock.over()
    return outcome("clearway DEFAULT", seed, trainer.frames, clock)


class Watch(BaseCallback):
    """Looks at the clock after each of SB3's updates; `falling_entropy` lets the entropy bonus fall as ours does."""

    def __init__(self, clock: SolvingClock, falling_entropy: bool = False) -> None:
        super().__init__()
        self.clock, self.falling_entropy = clock, falling_entropy
        self.over = False

    def _on_training_start(self) -> None:
        self.clock.start()

    def _on_rollout_start(self) -> None:
        if self.num_timesteps:
            self.over = self.clock.over()
        if self.falling_entropy:
            assert isinstance(self.model, PPO)
            self.model.ent_coef = DEFAULT.entropy_weight_at(self.num_timesteps)

    def _on_step(self) -> bool:
        return not self.over

    def _on_training_end(self) -> None:
        if not self.over:
            self.over = self.clock.over()


def sb3_agent(model: OnPolicyAlgorithm, world: World) -> Callable[[], Agent]:
    """Gives the agent as it stands, computed by the package's network, so that looking at it is quick."""
    policy = policy_of(model)
    network = SiameseActorCritic(policy.shape)
    assert world.features is not None
    lookup = LookupNetwork(network, world.features, world.target_state)

    def current() -> Agent:
        policy.copy_to(network)
        lookup.refresh()
        return network_on_poses(lookup, world)

    return current


def default_ppo_outcome(world: World, scenes: Sequence[Scene], seed: int, cap_s: float, envs: int) -> Outcome:
    """SB3's PPO as it comes, with a fused Adam."""
    with closing(vec_env("batched", scenes, envs)) as made:
        settings = network_settings(world, eps=1e-5, fused=True)
        model = PPO(SiamesePolicy, made, policy_kwargs=settings, device="cpu", seed=seed)
        clock = SolvingClock(world, sb3_agent(model, world), cap_s)
        model.learn(ENDLESS, callback=Watch(clock))
        return outcome(f"SB3 PPO, defaults, {envs} environments", seed, model.num_timesteps, clock)


def tuned_ppo_outcome(world: World, scenes: Sequence[Scene], seed: int, cap_s: float) -> Outcome:
    """SB3's PPO with the values of our recipe."""
    recipe = DEFAULT
    scale = recipe.reward_scale
    scaled: dict[str, Any] = {name: scale * value for name, value in COLLISION_AWARE.parameters.items()}
    reward = COLLISION_AWARE.with_changes(**scaled)
    with closing(vec_env("batched", scenes, recipe.envs, reward, recipe.step_limit)) as made:
        model = PPO(
            SiamesePolicy,
            made,
            learning_rate=lambda left: recipe.lr_at(round((1 - left) * recipe.frames)),
            n_steps=recipe.rollout_steps,
            batch_size=recipe.envs * recipe.rollout_steps // recipe.minibatches,
            n_epochs=recipe.epochs,
            gamma=recipe.discount,
            gae_lambda=recipe.gae_lambda,
            clip_range=recipe.ratio_clip,
            normalize_advantage=False,
            ent_coef=recipe.entropy_start,
            vf_coef=recipe.value_weight / 2,  # of the squared error; ours is of its half
            max_grad_norm=recipe.clip_norm,
            policy_kwargs=network_settings(world, eps=1e-8, fused=True),
            device="cpu",
            seed=seed,
        )
        clock = SolvingClock(world, sb3_agent(model, world), cap_s)
        model.learn(recipe.frames, callback=Watch(clock, falling_entropy=True))
        return outcome("SB3 PPO, our recipe's values", seed, model.num_timesteps, clock)


def measure_quality(
    scene: Scene,
    seeds: Sequence[int],
    cap_s: float,
    ppo_envs: Sequence[int],
    tuned: bool,
    progress: Callable[[str], None],
) -> list[Outcome]:
    """Every agent with every seed."""
    scenes = prepared([scene])
    world = world_of(scenes)
    outcomes = []
    for seed in seeds:
        progress(f"training ours, seed {seed}")
        outcomes.append(our_outcome(world, seed, cap_s))
        for envs in ppo_envs:
            progress(f"training SB3's PPO with {envs} environments, seed {seed}")
            outcomes.append(default_ppo_outcome(world, scenes, seed, cap_s, envs))
        if tuned:
            progress(f"training SB3's PPO with our recipe's values, seed {seed}")
            outcomes.append(tuned_ppo_outcome(world, scenes, seed, cap_s))
    return outcomes
