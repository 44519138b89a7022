"""What several workers cost: frames/s beside one process, communication, and a model for more machines.

    python benchmarks/scaling.py --json record.json

In one run, for each number of made-up scenes: one process with two threads, one with one, two workers with a thread
each; all learn from the same 400 environments with PPO's defaults, at 2,048 features. Wall time is disturbed by what
else runs on the machine; processor time is told beside it.

The model of an update by W workers, with what was measured:

    seconds = fixed + divided / W + bytes * 2 (W - 1) / W / bandwidth + messages * 2 (W - 1) * latency

`fixed` is what every worker does however few rows it has; a message goes round a ring, as gloo's does.
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import torch
import torch.distributed as dist
import torch.multiprocessing as multiprocessing
from throughput import made_up_scene

from clearway.learn.peers import Peers
from clearway.learn.presets import DEFAULT
from clearway.learn.provenance import hardware, package_versions
from clearway.learn.train import RunRequest
from clearway.reward import COLLISION_AWARE
from clearway.scenes.targets import default_targets

SCENES = (2, 20, 200)
CELLS = 60  # of a scene, with four headings each
WARM_UP = 3  # updates
LARGE = 4 * 512 * 2_048  # numbers of the first layer
WORKERS = (1, 4, 16, 64, 256)
NETWORKS = {  # bits/s, seconds of latency
    "10 Gbit/s, 0.05 ms": (10e9, 0.05e-3),
    "1 Gbit/s, 0.2 ms": (1e9, 0.2e-3),
    "100 Mbit/s, 5 ms": (100e6, 5e-3),
}


@dataclass(frozen=True)
class Measured:
    """What one worker found, per update; times in seconds.

    Attributes:
        frames_per_s: of all workers together.
        wall, processor, computed, waited: of this worker; `processor` adds up its threads.
        messages, sent_bytes: of this worker.
    """

    frames_per_s: float
    wall: float
    processor: float
    computed: float
    waited: float
    messages: float
    sent_bytes: float


def request(scenes: int) -> RunRequest:
    """A training on so many made-up scenes."""
    made = [made_up_scene(f"scene {number:03d}", 4 * CELLS, number) for number in range(scenes)]
    learner = replace(DEFAULT, heads="shared" if scenes > 20 else "scene")
    return RunRequest(made, {scene.name: default_targets(scene) for scene in made}, learner, COLLISION_AWARE)


def measure(rank: int, count: int, threads: int, scenes: int, seconds: float, port: int, answers: Any) -> None:
    """Put what this worker finds into `answers`; without scenes, the loopback's latency and bandwidth."""
    torch.set_num_threads(threads)
    peers = Peers()
    if count > 1:
        store = dist.TCPStore("localhost", port, count, is_master=rank == 0)
        peers = Peers(dist.ProcessGroupGloo(store, rank, count))
    answers.put((rank, network(peers) if not scenes else asdict(updates(request(scenes), peers, seconds))))
    peers.told(0.0)  # nobody leaves before all are done


def updates(asked: RunRequest, peers: Peers, seconds: float) -> Measured:
    """Update for so long."""
    trainer = asked.trainer(peers)
    for _ in range(WARM_UP):
        trainer.update()
    before = peers.messages, peers.sent_bytes, peers.waited_s
    frames, started, processor, number = trainer.frames, time.monotonic(), time.process_time(), 0
    while True:
        trainer.update()
        number += 1
        [over] = peers.any(peers.leads and time.monotonic() - started > seconds)
        if over:
            break
    wall, processor = time.monotonic() - started, time.process_time() - processor
    after = peers.messages, peers.sent_bytes, peers.waited_s
    messages, sent, waited = ((now - then) / number for now, then in zip(after, before, strict=True))
    each = wall / number
    return Measured((trainer.frames - frames) / wall, each, processor / number, each - waited, waited, messages, sent)


def network(peers: Peers) -> dict[str, float]:
    """Seconds of a message of one number and of one of the first layer's size."""
    found = {}
    for name, numbers, times in (("small", 1, 500), ("large", LARGE, 20)):
        message = torch.ones(numbers)
        peers.add_up(message)
        started = time.monotonic()
        for _ in range(times):
            peers.add_up(message.fill_(1.0))
        found[name] = (time.monotonic() - started) / times
    return found


def run(count: int, threads: int, scenes: int, seconds: float) -> list[dict[str, float]]:
    """What each of so many workers found."""
    with socket.socket() as free:
        free.bind(("localhost", 0))
        port = free.getsockname()[1]
    context = multiprocessing.get_context("spawn")
    answers = context.SimpleQueue()
    arguments = (count, threads, scenes, seconds, port, answers)
    started = multiprocessing.spawn(measure, arguments, count, join=False)
    found = dict(answers.get() for _ in range(count))
    while not started.join():
        pass
    return [found[rank] for rank in range(count)]


def predicted(fitted: dict[str, float], workers: int, bits_per_s: float, latency_s: float, grows: bool) -> dict:
    """The model's parts for so many workers; `grows`: each has so many environments."""
    rounds = 2 * (workers - 1)
    parts = {
        "fixed": fitted["fixed"],
        "divided": fitted["divided"] * (1.0 if grows else 1 / workers),
        "bandwidth": fitted["bytes"] * rounds / workers * 8 / bits_per_s,
        "latency": fitted["messages"] * rounds * latency_s,
    }
    return {**parts, "seconds": sum(parts.values()), "most": max(parts, key=parts.__getitem__)}


def main() -> None:
    """Measure, print, and write the record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=8.0, help="of every measurement")
    parser.add_argument("--scenes", type=int, nargs="+", default=SCENES)
    parser.add_argument("--json", type=Path, help="where the record is written")
    args = parser.parse_args()
    os.environ.setdefault("GLOO_SOCKET_IFNAME", "lo")
    loopback = run(2, 1, 0, 0.0)[0]
    print(
        f"a message on this machine: {loopback['small'] * 1e3:.3f} ms of one number, "
        f"{loopback['large'] * 1e3:.1f} ms of {LARGE:,}"
    )
    print("\nscenes | who | frames/s | wall, processor, waited s/update | messages, MB/update | load of the machine")
    record: dict[str, Any] = {
        "hardware": hardware(),
        "versions": package_versions(),
        "loopback": loopback,
        "measured": {},
    }
    for scenes in args.scenes:
        for who, (count, threads) in {
            "one process, 2 threads": (1, 2),
            "one process, 1 thread": (1, 1),
            "2 workers, 1 thread each": (2, 1),
        }.items():
            found = run(count, threads, scenes, args.seconds)
            record["measured"][f"{scenes} scenes, {who}"] = found
            one = found[0]
            processor, waited = sum(each["processor"] for each in found), max(each["waited"] for each in found)
            print(
                f"{scenes} | {who} | {one['frames_per_s']:,.0f} | {one['wall']:.3f}, {processor:.3f}, {waited:.3f} | "
                f"{one['messages']:.1f}, {one['sent_bytes'] / 1e6:.1f} | {os.getloadavg()[0]:.1f}",
                flush=True,
            )
        record["model"] = model(record["measured"], scenes, loopback)
    if args.json:
        args.json.write_text(json.dumps(record) + "\n")


def model(measured: dict[str, Any], scenes: int, loopback: dict[str, float]) -> dict[str, Any]:
    """Fit the model to what was measured at so many scenes; print how it fits and what it says of more machines.

    Processor time is fitted: it is disturbed less than wall time.
    """
    [alone], pair = (
        measured[f"{scenes} scenes, one process, 1 thread"],
        measured[f"{scenes} scenes, 2 workers, 1 thread each"],
    )
    half = sum(each["processor"] for each in pair) / 2
    fitted = {
        "fixed": max(2 * half - alone["processor"], 0.0),
        "divided": min(2 * (alone["processor"] - half), alone["processor"]),
        "messages": pair[0]["messages"],
        "bytes": pair[0]["sent_bytes"],
    }
    latency_s = loopback["small"] / 2  # of two hops
    bits_per_s = LARGE * 4 * 8 / max(loopback["large"] - loopback["small"], 1e-9)
    here = predicted(fitted, 2, bits_per_s, latency_s, grows=False)
    print(f"\nmodel at {scenes} scenes: " + ", ".join(f"{name} {value:.4g}" for name, value in fitted.items()))
    print(f"two workers here: {here['seconds']:.3f} s/update by the model, {pair[0]['wall']:.3f} measured")
    frames = DEFAULT.envs * DEFAULT.rollout_steps
    print("network | machines | same 400 environments: s/update, frames/s, most | 400 each: s/update, frames/s, most")
    table = {}
    for name, (bits, latency) in NETWORKS.items():
        for workers in WORKERS:
            same, more = (predicted(fitted, workers, bits, latency, grows) for grows in (False, True))
            table[f"{name}, {workers}"] = same, more
            print(
                f"{name} | {workers} | {same['seconds']:.2f}, {frames / same['seconds']:,.0f}, {same['most']} | "
                f"{more['seconds']:.2f}, {workers * frames / more['seconds']:,.0f}, {more['most']}"
            )
    print()
    return {"fitted": fitted, "here": here, "table": table}


if __name__ == "__main__":
    main()
