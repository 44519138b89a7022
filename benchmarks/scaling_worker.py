"""A process that trains for scaling.py: it says when it is ready, then answers lines of standard input.

A line is "train N", so many updates, or "send N", a message of so many numbers to be added up; the answer is what it
took, a line of JSON. Nothing is read from or written to files but the store at which workers meet.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import torch
import torch.distributed as dist

from clearway.generation.plans import generated_plan
from clearway.generation.request import Request
from clearway.learn.on_policy import OnPolicy
from clearway.learn.peers import Peers
from clearway.learn.presets import DEFAULT
from clearway.learn.train import RunRequest
from clearway.learn.trainer import Trainer
from clearway.reward import COLLISION_AWARE
from clearway.scenes.plan_scenes import floor_plan_scene
from clearway.scenes.scene import Scene
from clearway.scenes.targets import default_targets

ENDLESS = 10**9  # frames of the schedules; none ends during a benchmark
FEATURES = 2048
MOST_HEADS = 20  # scenes that have a head each; more share one, see docs/learning.md


class CountedPeers(Peers):
    """Workers that count the messages in which nothing is added up, which have half the hops."""

    gathered = 0

    def told(self, *numbers: float) -> list[list[float]]:
        """As of `Peers`."""
        self.gathered += self.count > 1
        return super().told(*numbers)


def scenes_of(count: int) -> list[Scene]:
    """Generated rooms with made-up features."""
    return [floor_plan_scene(generated_plan(Request("room", "train", 0, n)), FEATURES) for n in range(count)]


def learner_of(scenes: int, changed: str = "{}") -> OnPolicy:
    """The default learner, some of its settings changed (JSON); every scene has an environment at least."""
    learner = replace(DEFAULT, frames=ENDLESS, heads="scene" if scenes <= MOST_HEADS else "shared")
    return replace(learner, **json.loads(changed))


def main() -> None:
    """Train as told."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--scenes", type=int, required=True)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--rank", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--store", type=Path, help="file at which workers meet")
    parser.add_argument("--set", default="{}", help="settings, JSON")
    given = parser.parse_args()
    torch.set_num_threads(given.threads)
    scenes = scenes_of(given.scenes)
    request = RunRequest(
        scenes, {s.name: default_targets(s) for s in scenes}, learner_of(len(scenes), given.set), COLLISION_AWARE
    )
    peers = CountedPeers()
    if given.workers > 1:
        store = dist.FileStore(str(given.store), given.workers)
        dist.init_process_group(
            "gloo", store=store, rank=given.rank, world_size=given.workers, timeout=timedelta(minutes=5)
        )
        peers = CountedPeers(dist.group.WORLD)
    trainer = request.trainer(peers)
    assert isinstance(trainer, Trainer)
    print(json.dumps({"envs": trainer.env_count, "states": sum(s.state_count for s in scenes)}), flush=True)
    for line in sys.stdin:
        what, number = line.split()
        peers.any(False)  # all begin together
        answer = trained(trainer, peers, int(number)) if what == "train" else sent(peers, int(number))
        print(json.dumps(answer), flush=True)


def trained(trainer: Trainer, peers: CountedPeers, updates: int) -> dict[str, float]:
    """Seconds, frames and communication of so many updates."""

    def counts() -> tuple[float, ...]:
        return peers.messages, peers.gathered, peers.sent_bytes, peers.waited_s, trainer.frames, time.perf_counter()

    before = counts()
    for _ in range(updates):
        trainer.update()
    names = ("messages", "gathered", "bytes", "waited_s", "frames", "s")
    return dict(zip(names, (late - early for late, early in zip(counts(), before, strict=True)), strict=True))


def sent(peers: Peers, numbers: int) -> dict[str, float]:
    """Seconds of adding up so many float32."""
    message, started = torch.zeros(numbers), time.perf_counter()
    peers.add_up(message)
    return {"s": time.perf_counter() - started}


if __name__ == "__main__":
    main()
