"""How fast A3C is: frames/s beside the straightforward loop, and beside what main memory would allow.

    python benchmarks/a3c.py                     # a minute or two
    python benchmarks/a3c.py --seconds 3 --repeats 2

Everything is measured in one run with the same number of processes, and repeats of all cases are interleaved.
The world is that of throughput.py: four made-up floor plans of the paper's sizes, 20 targets, the paper's network.

The straightforward loop is A3C as it is usually written in PyTorch: a process for a worker with one environment, a
model in shared memory, a local copy of it loaded at the beginning of each five-step segment, inputs of 8192 copied
numbers, autograd over the segment's five rows together, each tensor's gradient clipped, RMSProp with one tensor
operation after the other.

The memory bound. An update changes the weights of the siamese and the fusion layer and of one scene's head, and their
mean squares: each is read and written. If every update crossed main memory by itself, that traffic alone would allow
`bound` frames/s at the bandwidth measured here with all processes at work (each doubling an array of its own, reads
and writes counted). Ours may exceed it, because a process brings a block of weights into its cache once for all its
workers' updates; `traffic` is what this leaves, with the local copy and the forward passes, which read the siamese
layer's slots again as poses arrive. What limits it then is the five passes through the cache that PyTorch's operations
need for each update.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from multiprocessing import get_context
from multiprocessing.connection import Connection

import torch
from throughput import FEATURES, PlainNetwork, device_name, made_up_world
from torch import Tensor

from clearway.learn.a3c.parent import AsyncTrainer
from clearway.learn.presets import PAPER_A3C
from clearway.learn.rollout import ACTION_STREAM, sample_actions
from clearway.model.network import OUTPUTS
from clearway.reward import COLLISION_AWARE
from clearway.scenes.actions import ACTION_COUNT
from clearway.world.navigation import Navigation
from clearway.world.streams import Streams
from clearway.world.world import World

LEARNER = replace(PAPER_A3C, frames=10**9)  # no schedule ends during a benchmark
ALPHA, EPSILON = 0.99, 0.1
BANDWIDTH_ARRAY_BYTES = 128 * 1024**2


class PlainWorker:
    """A worker of the straightforward loop."""

    def __init__(self, number: int, world: World, shared: PlainNetwork, squares: list[Tensor]) -> None:
        self.world, self.shared, self.squares = world, shared, squares
        self.local = PlainNetwork(world.scene_count, LEARNER.width, LEARNER.history_length)
        self.target = torch.tensor([number * world.target_count // LEARNER.envs])
        self.rows_per_scene = [int(world.target_scene[self.target] == scene) for scene in range(world.scene_count)]
        reward = replace(COLLISION_AWARE, clip=True)
        seeds = torch.tensor([number])
        self.navigation = Navigation(world, reward, seeds, step_limit=LEARNER.step_limit)
        self.navigation.reset(target=self.target)
        self.action_stream = Streams(seeds, ACTION_STREAM)

    def outputs(self, history: Tensor) -> Tensor:
        """(B, 5) action scores and values for histories (B, K)."""
        features, rows = self.world.features, len(history)
        assert features is not None
        wanted = features[self.world.target_state[self.target]].repeat(rows, LEARNER.history_length)
        return self.local(features[history].flatten(1), wanted, [rows * count for count in self.rows_per_scene])

    def update(self) -> int:
        """One segment and its update; returns its frames."""
        self.local.load_state_dict(self.shared.state_dict())
        history, action, reward, outcome = self.segment()
        returns = torch.empty_like(reward)
        for t in reversed(range(len(reward))):
            outcome = reward[t] + LEARNER.discount * outcome
            returns[t] = outcome
        self.local.zero_grad()
        output = self.outputs(history)
        log_pi, error = torch.log_softmax(output[:, :ACTION_COUNT], 1), returns - output[:, -1]
        taken, entropy = log_pi.gather(1, action[:, None])[:, 0], -(log_pi.exp() * log_pi).sum(1)
        loss = -taken * error.detach() - LEARNER.entropy_start * entropy + 0.5 * LEARNER.value_weight * error**2
        loss.sum().backward()
        self.step()
        return len(reward)

    @torch.no_grad()
    def segment(self) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Histories (T, K), actions (T,) and rewards (T,) of a segment, and the value after it."""
        nav, rows = self.navigation, []
        for _ in range(LEARNER.rollout_steps):
            history = nav.history
            action = sample_actions(self.outputs(history)[:, :ACTION_COUNT], self.action_stream.uniform())
            step = nav.step(action)
            rows.append((history, action, step.reward))
            if step.ended:
                break
        outcome = torch.zeros(()) if step.ended else self.outputs(nav.history)[0, -1]
        if step.ended:
            nav.reset(target=self.target)
        history, action, reward = (torch.cat(column) for column in zip(*rows, strict=True))
        return history, action, reward, outcome

    @torch.no_grad()
    def step(self) -> None:
        """Clip each tensor's gradient, then RMSProp on the shared parameters."""
        for local, shared, square in zip(self.local.parameters(), self.shared.parameters(), self.squares, strict=True):
            if local.grad is not None:
                torch.nn.utils.clip_grad_norm_(local, LEARNER.clip_norm)
                square.mul_(ALPHA).addcmul_(local.grad, local.grad, value=1 - ALPHA)
                shared.addcdiv_(local.grad, (square + EPSILON).sqrt_(), value=-LEARNER.lr_start)


def serve_plain_worker(
    number: int, world: World, shared: PlainNetwork, squares: list[Tensor], connection: Connection
) -> None:
    """Process: for every number of seconds received, update that long and send the frames used."""
    torch.set_num_threads(1)
    worker = PlainWorker(number, world, shared, squares)
    worker.update()
    serve(connection, worker.update)


def serve_bandwidth(connection: Connection) -> None:
    """Process: for every number of seconds received, double an array that long and send the bytes moved."""
    torch.set_num_threads(1)
    array = torch.zeros(BANDWIDTH_ARRAY_BYTES // 4)

    def double() -> int:
        array.add_(array)
        return 2 * BANDWIDTH_ARRAY_BYTES

    double()
    serve(connection, double)


def serve(connection: Connection, work: Callable[[], int]) -> None:
    """Say that all is ready, then answer every number of seconds with the work done a second."""
    connection.send("ready")
    while (seconds := connection.recv()) is not None:
        started, done = time.perf_counter(), 0
        while time.perf_counter() - started < seconds:
            done += work()
        connection.send(done / (time.perf_counter() - started))


class Servers:
    """Processes that measure side by side."""

    def __init__(self, target: Callable, arguments: list[tuple]) -> None:
        context = get_context("spawn")
        self.connections, self.processes = [], []
        for each in arguments:
            ours, theirs = context.Pipe()
            process = context.Process(target=target, args=(*each, theirs), daemon=True)
            process.start()
            self.connections.append(ours)
            self.processes.append(process)
        for connection in self.connections:
            assert connection.recv() == "ready"

    def rate(self, seconds: float) -> float:
        """Work a second of all together."""
        for connection in self.connections:
            connection.send(seconds)
        return sum(connection.recv() for connection in self.connections)

    def close(self) -> None:
        """End the processes."""
        for connection, process in zip(self.connections, self.processes, strict=True):
            connection.send(None)
            process.join()


def our_rate(trainer: AsyncTrainer, seconds: float) -> float:
    """Frames/s of the package's A3C; its workers are paused afterwards."""
    started, before = time.perf_counter(), trainer.frames
    while time.perf_counter() - started < seconds:
        trainer.update()
    trainer.tensors()
    return (trainer.frames - before) / (time.perf_counter() - started)


@dataclass(frozen=True)
class Figures:
    """What was measured, medians over the repeats.

    Attributes:
        ours, plain: frames/s; with the smallest and the largest.
        times_plain: ours over plain.
        bandwidth_gb_per_s: of main memory, read and write.
        frames_per_update: of ours.
        bytes_per_update: weights and mean squares that an update reads and writes.
        bound: frames/s if each update crossed main memory by itself and nothing else did.
        share_of_bound: ours over bound.
        traffic_bytes_per_update: what ours moves, as scheduled.
        share_of_bandwidth: of that traffic at our frames/s.
    """

    processes: int
    workers: int
    ours: tuple[float, float, float]
    plain: tuple[float, float, float]
    times_plain: float
    bandwidth_gb_per_s: float
    frames_per_update: float
    bytes_per_update: int
    bound: float
    share_of_bound: float
    traffic_bytes_per_update: float
    share_of_bandwidth: float


def run(processes: int, seconds: float, repeats: int, progress: Callable[[str], None]) -> Figures:
    """Measure everything."""
    world = made_up_world("cpu")
    shared = PlainNetwork(world.scene_count, LEARNER.width, LEARNER.history_length).share_memory()
    squares = [torch.ones_like(p).share_memory_() for p in shared.parameters()]
    numbers = [LEARNER.envs * process // processes for process in range(processes)]
    ours, plain, bandwidth = [], [], []
    with (
        closing(AsyncTrainer(world, LEARNER, LEARNER.paid(COLLISION_AWARE), 0, processes)) as trainer,
        closing(Servers(serve_plain_worker, [(number, world, shared, squares) for number in numbers])) as plain_workers,
        closing(Servers(serve_bandwidth, [()] * processes)) as copiers,
    ):
        progress("warming up")
        trainer.update()
        trainer.tensors()
        for repeat in range(repeats):
            progress(f"repeat {repeat + 1} of {repeats}")
            bandwidth.append(copiers.rate(min(seconds, 1.0)))
            plain.append(plain_workers.rate(seconds))
            ours.append(our_rate(trainer, seconds))
        frames_per_update = trainer.frames / trainer.updates
    return figures(processes, ours, plain, statistics.median(bandwidth), frames_per_update)


def figures(
    processes: int, ours: list[float], plain: list[float], bandwidth: float, frames_per_update: float
) -> Figures:
    """The figures from what was measured."""
    width, history, steps = LEARNER.width, LEARNER.history_length, LEARNER.rollout_steps
    slot = width * FEATURES
    touched = history * slot + 2 * width * width + width * width + OUTPUTS * width + 3 * width + OUTPUTS
    a_process = LEARNER.envs / processes  # workers
    slots_read = history + sum(min(history, steps + 1 - step) for step in range(1, steps + 1))
    traffic = (4 * touched + 2 * touched + slots_read * slot) * 4 / a_process
    rate, bound = statistics.median(ours), bandwidth / (16 * touched) * frames_per_update
    return Figures(
        processes=processes,
        workers=LEARNER.envs,
        ours=(rate, min(ours), max(ours)),
        plain=(statistics.median(plain), min(plain), max(plain)),
        times_plain=rate / statistics.median(plain),
        bandwidth_gb_per_s=bandwidth / 1e9,
        frames_per_update=frames_per_update,
        bytes_per_update=16 * touched,
        bound=bound,
        share_of_bound=rate / bound,
        traffic_bytes_per_update=traffic,
        share_of_bandwidth=traffic * rate / frames_per_update / bandwidth,
    )


def text(result: Figures) -> str:
    """The figures as lines."""
    lines = [
        f"{'case':<28} {'frames/s':>9} {'min - max':>15} {'x plain':>8}",
        f"{'straightforward loop':<28} {result.plain[0]:>9,.0f} {_spread(result.plain):>15} {1:>8.1f}",
        f"{'clearway.learn.a3c':<28} {result.ours[0]:>9,.0f} {_spread(result.ours):>15} {result.times_plain:>8.1f}",
        "",
        f"main memory: {result.bandwidth_gb_per_s:.1f} GB/s with {result.processes} processes reading and writing",
        f"an update reads and writes {result.bytes_per_update / 1e6:.0f} MB of weights and mean squares and uses "
        f"{result.frames_per_update:.2f} frames:",
        f"each by itself, at most {result.bound:,.0f} frames/s; ours is {result.share_of_bound:.0%} of that",
        f"as scheduled it moves {result.traffic_bytes_per_update / 1e6:.0f} MB with copies and forward passes: "
        f"{result.share_of_bandwidth:.0%} of the bandwidth",
    ]
    return "\n".join(lines)


def _spread(rates: tuple[float, float, float]) -> str:
    return f"{rates[1]:,.0f} - {rates[2]:,.0f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--processes", type=int, default=torch.get_num_threads(), help="default: torch's threads")
    parser.add_argument("--seconds", type=float, default=6.0, help="of each case in each repeat")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--json", action="store_true", help="print JSON instead of the table")
    options = parser.parse_args()

    def progress(line: str) -> None:
        if not options.json:
            print(line, flush=True)

    result = run(options.processes, options.seconds, options.repeats, progress)
    if options.json:
        print(json.dumps({"device": device_name("cpu"), "torch": torch.__version__, **asdict(result)}, indent=2))
        return
    print(
        f"\n{device_name('cpu')}, {result.processes} processes, {result.workers} workers, torch {torch.__version__}\n"
    )
    print(text(result))


if __name__ == "__main__":
    main()
