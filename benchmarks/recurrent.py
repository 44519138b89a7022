"""Frames/s of our recurrent learner and of sb3-contrib's RecurrentPPO, in turn, on the same environment; memory.

    python benchmarks/recurrent.py rooms --out recurrent.json

Both learn by PPO alone, with two passes over each rollout in four minibatches, on one thread, from the same scenes,
targets, reward and step limit. RecurrentPPO is given the batched environment, which looks up what is seen beside the
target in the same table, so that it compares no pictures, and a network of the sizes of ours: two layers of 256, a
memory of 256 (an LSTM, it has no other) shared by policy and critic, a layer of 256 before the actions. It has two
numbers of environments and steps; the better one counts. Seconds are the process's own, so that other work on the
machine counts for neither. Beside ours stand the operations of its matrix products a frame, and which share of the
peak they come to: how far a faster program could go at all. Needs the extra sb3.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from sb3_contrib import RecurrentPPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecEnv
from torch.utils.flop_counter import FlopCounterMode

from clearway.api.scenes import load_scenes
from clearway.learn.provenance import hardware, package_versions
from clearway.learn.recurrent import Recurrent
from clearway.learn.recurrent_trainer import RecurrentTrainer
from clearway.model.pair_table import PairTable
from clearway.model.recurrent import LAST_COUNT, last_step
from clearway.reward import COLLISION_AWARE
from clearway.scenes.actions import ACTION_COUNT
from clearway.scenes.targets import default_targets
from clearway.torch_threads import torch_threads
from clearway.world.navigation import Navigation, TargetChoice
from clearway.world.world import World, make_world

OURS = Recurrent(taught=0.0, frames=10**9)
THEIRS = ((16, 128), (96, 32))  # environments, steps
PEAK_SIZES = (512, 1024)
ROUNDS = 3


class Rooms(VecEnv):
    """The environment as RecurrentPPO wants it: `Navigation`, and what is seen beside the target, from the table."""

    def __init__(self, world: World, table: PairTable, width: int, count: int) -> None:
        space = spaces.Box(-np.inf, np.inf, (width + LAST_COUNT,), np.float32)
        super().__init__(count, space, spaces.Discrete(ACTION_COUNT))
        scene = torch.arange(count) * world.scene_count // count
        choice = TargetChoice.by_scene(world, scene) if count >= world.scene_count else None
        self.navigation = Navigation(
            world, COLLISION_AWARE, torch.arange(count), choice=choice, step_limit=OURS.step_limit, history_length=1
        )
        self.table, self.last = table, torch.zeros(count, LAST_COUNT)

    def _seen(self) -> torch.Tensor:
        pairs = self.table(self.navigation.target, self.navigation.sighting)
        return torch.cat([pairs, self.last], dim=1)

    def reset(self) -> np.ndarray:
        """Begin all episodes."""
        self.navigation.reset()
        self.last = torch.zeros_like(self.last)
        return self._seen().numpy()

    def step_async(self, actions: np.ndarray) -> None:
        """Take the actions."""
        self.actions = torch.from_numpy(actions)

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """One step of all; episodes that end begin anew."""
        before = self.navigation.sighting
        step = self.navigation.step(self.actions)
        last = last_step(self.actions, self.table.likeness(self.navigation.sighting, before))
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        self.last = last
        if step.truncated.any():
            there = self._seen().numpy()
            for env in torch.nonzero(step.truncated)[:, 0].tolist():
                infos[env] = {"TimeLimit.truncated": True, "terminal_observation": there[env]}
        self.navigation.restart(step.ended)
        self.last = torch.where(step.ended[:, None], 0.0, last)
        return self._seen().numpy(), step.reward.numpy(), step.ended.numpy(), infos

    def close(self) -> None:
        """Nothing is held."""

    def get_attr(self, attr_name: str, indices: object = None) -> list[Any]:
        """The same of every environment."""
        return [None if attr_name == "render_mode" else getattr(self, attr_name)] * self.num_envs

    def set_attr(self, attr_name: str, value: object, indices: object = None) -> None:
        """Not used."""
        raise NotImplementedError

    def env_method(self, method_name: str, *args: object, indices: object = None, **settings: object) -> list[Any]:
        """Not used."""
        raise NotImplementedError

    def env_is_wrapped(self, wrapper_class: type, indices: object = None) -> list[bool]:
        """None are."""
        return [False] * self.num_envs


class Entry(BaseFeaturesExtractor):
    """Two layers, as ours."""

    def __init__(self, observation_space: spaces.Box, features_dim: int) -> None:
        super().__init__(observation_space, features_dim)
        count = observation_space.shape[0]
        first, second = torch.nn.Linear(count, features_dim), torch.nn.Linear(features_dim, features_dim)
        self.layers = torch.nn.Sequential(first, torch.nn.ReLU(), second, torch.nn.ReLU())

    def forward(self, seen: torch.Tensor) -> torch.Tensor:
        """What enters the memory."""
        return self.layers(seen)


class _Clock(BaseCallback):
    """Frames and seconds since the end of the first rollout, so that every rollout counts with its learning."""

    def __init__(self) -> None:
        super().__init__()
        self.marks: list[tuple[int, float]] = []

    def _on_rollout_start(self) -> None:
        self.marks.append((self.num_timesteps, time.process_time()))

    def _on_step(self) -> bool:
        return True


def their_rate(world: World, trainer: RecurrentTrainer, envs: int, steps: int, seconds: float) -> float:
    """Frames/s of RecurrentPPO over so many seconds or more, two rollouts at least."""
    width = OURS.width
    env = Rooms(world, trainer.seen, trainer.pairs.count, envs)
    model = RecurrentPPO(
        "MlpLstmPolicy",
        env,
        n_steps=steps,
        batch_size=envs * steps // OURS.minibatches,
        n_epochs=OURS.epochs,
        policy_kwargs={
            "lstm_hidden_size": width,
            "shared_lstm": True,
            "enable_critic_lstm": False,
            "net_arch": {"pi": [width], "vf": []},
            "features_extractor_class": Entry,
            "features_extractor_kwargs": {"features_dim": width},
        },
        device="cpu",
        seed=0,
    )
    clock, wanted = _Clock(), 2
    started = time.process_time()
    while len(clock.marks) < wanted + 1 or time.process_time() - started < seconds:
        model.learn(envs * steps, callback=clock, reset_num_timesteps=False)
    (first, since), (last, until) = clock.marks[0], clock.marks[-1]
    return (last - first) / (until - since)


def our_rate(trainer: RecurrentTrainer, seconds: float) -> float:
    """Frames/s of ours over so many seconds or more, two updates at least."""
    started, before, updates = time.process_time(), trainer.frames, 0
    while updates < 2 or time.process_time() - started < seconds:
        trainer.update()
        updates += 1
    return (trainer.frames - before) / (time.process_time() - started)


def gflop_per_frame(trainer: RecurrentTrainer) -> float:
    """Operations of the matrix products of an update, by the frames that it learns from."""
    before = trainer.frames
    with FlopCounterMode(display=False) as counted:
        trainer.update()
    return counted.get_total_flops() / (trainer.frames - before) / 1e9


def peak_gflops() -> float:
    """Best GFLOP/s of the process's own time of a product of square float32 matrices, on one thread."""
    best = 0.0
    for size in PEAK_SIZES:
        left, right = torch.rand(2, size, size)
        for _ in range(5):
            started = time.process_time()
            left @ right
            best = max(best, 2 * size**3 / (time.process_time() - started) / 1e9)
    return best


def memory(world: World, trainer: RecurrentTrainer) -> dict[str, float]:
    """Bytes of this world's tables, and what 1,000 rooms of its mean size would take, in megabytes."""
    assert world.features is not None
    features = 2 * world.features.numel()  # as float16, one picture a pose
    table = trainer.seen.bytes
    return {
        "rooms": world.scene_count,
        "poses": world.state_count,
        "targets": world.target_count,
        "features_float16_bytes": features,
        "pair_table_bytes": table,
        "features_float16_mb_per_1000_rooms": features / world.scene_count / 1e3,
        "pair_table_mb_per_1000_rooms": table / world.scene_count / 1e3,
    }


def main() -> None:
    """Measure, print, and keep the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", type=Path, nargs="+")
    parser.add_argument("--seconds", type=float, default=5.0, help="of each measurement")
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    scenes = load_scenes(asked.scenes)
    world = make_world(scenes, {scene.name: default_targets(scene, 0) for scene in scenes})
    with torch_threads(1):
        taught = replace(OURS, taught=1.0).trainer(world, COLLISION_AWARE, 0)
        paid = OURS.trainer(world, COLLISION_AWARE, 0)
        assert isinstance(taught, RecurrentTrainer) and isinstance(paid, RecurrentTrainer)
        cost = {"ours": gflop_per_frame(paid), "ours, taught": gflop_per_frame(taught)}
        rates: dict[str, list[float]] = {}
        peaks: list[float] = []

        def keep(name: str, rate: float) -> None:
            rates.setdefault(name, []).append(rate)
            print(f"{name}: {rate:,.0f} frames/s", flush=True)

        for _ in range(ROUNDS):
            peaks.append(peak_gflops())
            keep("ours", our_rate(paid, asked.seconds))
            keep("ours, taught", our_rate(taught, asked.seconds))
            for envs, steps in THEIRS:
                keep(f"RecurrentPPO, {envs} x {steps}", their_rate(world, paid, envs, steps, asked.seconds))
    medians = {name: statistics.median(found) for name, found in rates.items()}
    best = max(rate for name, rate in medians.items() if name.startswith("RecurrentPPO"))
    peak = statistics.median(peaks)
    told = {
        "frames_per_second": medians,
        "peak_gflops": peaks,
        "gflop_per_frame": cost,
        "share_of_peak": {name: medians[name] * gflop / peak for name, gflop in cost.items()},
        "rounds": rates,
        "ours_by_theirs": medians["ours"] / best,
        "memory": memory(world, paid),
        "versions": dict(package_versions()),
        "hardware": dict(hardware()),
    }
    asked.out.write_text(json.dumps(told, indent=1) + "\n")
    for name, rate in medians.items():
        print(f"median, {name}: {rate:,.0f} frames/s")
    print(f"peak of a product: {peak:.0f} GFLOP/s")
    for name, gflop in cost.items():
        share = medians[name] * gflop / peak
        print(f"{name}: {1e3 * gflop:.1f} MFLOP a frame, {share:.0%} of the peak")
    print(f"ours by the best of theirs: {told['ours_by_theirs']:.1f}")
    print(told["memory"])


if __name__ == "__main__":
    main()
