"""Frames/s of our A2C and of Stable-Baselines3's, for peers.py."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from typing import get_args

from sb3 import SiamesePolicy, network_settings, policy_of, vec_env
from scene_sets import ON_PREPARED, world_of
from stable_baselines3 import A2C
from throughput import ENDLESS

from clearway.choices import MatmulPrecision
from clearway.learn import algorithms
from clearway.learn.algorithms import carried_over
from clearway.learn.on_policy import OnPolicy
from clearway.learn.trainer import Trainer
from clearway.reward import COLLISION_AWARE
from clearway.scenes.scene import Scene
from clearway.world.world import World

A2C_LIKE = replace(
    carried_over(ON_PREPARED, algorithms.A2C), frames=ENDLESS, hindsight=False, lookahead=0.0, feature_basis=0
)
OURS = tuple(
    replace(A2C_LIKE, envs=envs, matmul_precision=precision)
    for envs in (400, 1600)
    for precision in get_args(MatmulPrecision)
)
OWN_KINDS = (("dummy", 16, 5), ("dummy", 100, 5), ("dummy", 100, 20), ("subproc", 8, 5), ("subproc", 16, 20))
BATCHED = (("batched", 16, 5), ("batched", 100, 20), ("batched", 400, 20), ("batched", 800, 20))


@dataclass
class Runner:
    """Something that trains, update by update.

    Attributes:
        name, envs, steps: of it.
        update: one rollout and what is learnt from it.
        close: give back processes and memory.
    """

    name: str
    envs: int
    steps: int
    update: Callable[[], object]
    close: Callable[[], None]

    def rate(self, seconds: float) -> float:
        """Frames/s over at least that many seconds."""
        started, updates = time.perf_counter(), 0
        while time.perf_counter() - started < seconds:
            self.update()
            updates += 1
        return updates * self.envs * self.steps / (time.perf_counter() - started)


def our_runner(world: World, learner: OnPolicy) -> Runner:
    """The package's A2C."""
    trainer = Trainer(world, learner, COLLISION_AWARE, seed=0)
    name = f"clearway A2C, {str(trainer.lookup.dtype).removeprefix('torch.')}"
    return Runner(name, learner.envs, learner.rollout_steps, trainer.update, trainer.close)


def sb3_runner(world: World, scenes: Sequence[Scene], kind: str, envs: int, steps: int) -> Runner:
    """SB3's A2C on environments of a kind."""
    made = vec_env(kind, scenes, envs)
    model = A2C(SiamesePolicy, made, n_steps=steps, policy_kwargs=network_settings(world), device="cpu", seed=0)
    policy_of(model)

    def update() -> None:
        model.learn(envs * steps, reset_num_timesteps=False)

    return Runner(f"SB3 A2C, {kind}", envs, steps, update, made.close)


@dataclass(frozen=True)
class Speed:
    """Frames/s of a runner: median, smallest and largest over its repeats."""

    name: str
    envs: int
    steps: int
    repeats: int
    median: float
    smallest: float
    largest: float


@dataclass(frozen=True)
class Trial:
    """Frames/s of a size of SB3's A2C when the fastest was looked for."""

    kind: str
    envs: int
    steps: int
    frames_per_s: float


def measure_speed(
    scenes: Sequence[Scene], seconds: float, repeats: int, progress: Callable[[str], None]
) -> tuple[list[Speed], list[Trial]]:
    """Ours, then SB3's fastest of its own kinds and of the batched one; and what was tried to find them."""
    world, trials = world_of(scenes), []
    best = []
    for sizes in (OWN_KINDS, BATCHED):
        found = []
        for kind, envs, steps in sizes:
            progress(f"trying SB3's A2C, {kind}, {envs} x {steps}")
            with closing(sb3_runner(world, scenes, kind, envs, steps)) as runner:
                runner.update()
                found.append(Trial(kind, envs, steps, runner.rate(seconds / 2)))
        trials += found
        best.append(max(found, key=lambda trial: trial.frames_per_s))
    runners = [our_runner(world, learner) for learner in OURS]
    runners += [sb3_runner(world, scenes, trial.kind, trial.envs, trial.steps) for trial in best]
    for runner in runners:
        runner.update()
    rates: list[list[float]] = [[] for _ in runners]
    for repeat in range(repeats):
        progress(f"repeat {repeat + 1} of {repeats}")
        for runner, found_rates in zip(runners, rates, strict=True):
            found_rates.append(runner.rate(seconds))
    for runner in runners:
        runner.close()
    speeds = [
        Speed(r.name, r.envs, r.steps, repeats, statistics.median(found), min(found), max(found))
        for r, found in zip(runners, rates, strict=True)
    ]
    return speeds, trials
