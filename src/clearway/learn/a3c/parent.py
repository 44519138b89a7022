"""The parent of A3C's worker processes: starts, watches, pauses and ends them, and adds up what they report.

To `learn.train` it is a trainer like the synchronous one: `update` lets the workers go on until some frames are used,
`tensors` pauses all of them between rounds for a consistent snapshot.
"""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from dataclasses import replace
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait

import torch
from torch import Tensor

from clearway.children import ChildProcess, check_program, children_import_program, signals_held
from clearway.errors import RunError
from clearway.learn.a3c.config import A3C
from clearway.learn.a3c.group import WorkerGroup
from clearway.learn.a3c.process import Assignment, Message, WorkerReport, work, world_tensors
from clearway.learn.a3c.shared import SharedTensors
from clearway.learn.figures import Figures, check_finite
from clearway.learn.named_tensors import joined, part_of
from clearway.learn.optimiser import EPSILON
from clearway.learn.statistics import EpisodeStatistics
from clearway.model.feature_map import network_input
from clearway.model.network import NetworkShape, SiameseActorCritic
from clearway.reward import Reward
from clearway.world.world import World

PLACES = {"parameters": "network", "squares": "optimiser.square_plus_epsilon", "workers": "workers"}
"""Parts of the shared memory, and what they are called in a checkpoint."""
SECONDS_TO_END = 5.0  # a round takes a fraction of a second


class AsyncTrainer:
    """Learns a policy for a world with asynchronous workers.

    Args:
        world: tables of the scenes and targets; must hold features, on the processor.
        learner: the settings; `envs` workers, of which worker i begins with target i modulo the number of targets.
        reward: what is earned.
        seed: of parameters, environments and actions. With one process a seed repeats bit for bit; with more, the
            order in which they meet in shared memory is not repeatable.
        processes: at most this many; workers are dealt out evenly.

    Raises:
        RunError: the world is not on the processor, features are missing or not finite, there are fewer workers than
            targets, or no memory is left.
        RewardError: processes cannot import a term of the reward.
    """

    def __init__(self, world: World, learner: A3C, reward: Reward, seed: int, processes: int = 1) -> None:
        if world.device.type != "cpu":
            raise RunError(f"a3c on the device {world.device}, expected cpu. Leave out --device")
        if learner.envs < world.target_count:
            raise RunError(
                f"{learner.envs} workers for {world.target_count} targets. Give --set envs={world.target_count} or more"
            )
        reward.check_sent(main_too=children_import_program())
        self.world, self.learner, self.reward, self.seed = world, learner, reward, seed
        self.frames, self.updates = 0, 0
        self.feature_map, features = network_input(world, learner)
        self.statistics = EpisodeStatistics(learner.envs, world.target_count, world.device)
        self.process_count = min(processes, learner.envs)
        self.shared = self._new_shared(features)
        self._processes: list[ChildProcess] = []
        self._connections: list[Connection] = []
        self._paused = False
        self._reports: list[WorkerReport] = []

    def _new_shared(self, features: Tensor) -> SharedTensors:
        """Shared memory with everything at its start; features (S, F) as the network takes them."""
        learner, world = self.learner, replace(self.world, features=features)
        shape = NetworkShape(world.scene_count, self.feature_map.input_count, learner.width, learner.history_length)
        parameters = {name: p.data for name, p in SiameseActorCritic(shape, self.seed).named_parameters()}
        squares = {name: torch.full_like(tensor, 1 + EPSILON) for name, tensor in parameters.items()}
        workers = _by_target(learner.envs, world.target_count)
        begun = WorkerGroup(world, learner, self.reward, self.seed, workers, parameters, squares).tensors()
        place = torch.argsort(workers)
        return SharedTensors.holding(
            {
                **world_tensors(world),
                **{f"parameters.{name}": tensor for name, tensor in parameters.items()},
                **{f"squares.{name}": tensor for name, tensor in squares.items()},
                **{f"workers.{name}": tensor[place] for name, tensor in begun.items()},
                "frames": torch.zeros(self.process_count + 1, dtype=torch.int64),
            }
        )

    @property
    def frames_per_update(self) -> int:
        """Frames that one call of `update` uses, about."""
        return self.learner.envs * self.learner.rollout_steps

    @property
    def finished(self) -> bool:
        """All frames of the settings are used."""
        return self.frames >= self.learner.frames

    def update(self) -> Figures:
        """Let the workers use some more frames; returns means over their updates.

        Raises:
            RunError: a process has died or cannot begin, or the loss or a gradient is not finite.
        """
        if not self._processes:
            self._start()
        elif self._paused:
            self._tell(Message.GO)
            self._paused = False
        until = min(self.frames + self.frames_per_update, self.learner.frames)
        while self.frames < until:
            for message in self._messages():
                assert isinstance(message, WorkerReport)
                self._add(message)
        result, self._reports = _mean(self._reports), []
        return result

    def tensors(self) -> dict[str, Tensor]:
        """All that `load_tensors` needs to go on, besides `frames` and `updates`. Workers pause until the next update.

        Raises:
            RunError: a process has died, or the loss or a gradient is not finite.
        """
        if self._processes and not self._paused:
            self._tell(Message.PAUSE)
            waiting = len(self._processes)
            while waiting:
                for message in self._messages():
                    if message is Message.PAUSED:
                        waiting -= 1
                    else:
                        assert isinstance(message, WorkerReport)
                        self._add(message)
            self._paused = True
        shared = {name: part_of(self.shared, part) for part, name in PLACES.items()}
        return joined({**shared, "statistics": self.statistics.tensors()})

    def load_tensors(self, tensors: dict[str, Tensor], frames: int, updates: int) -> None:
        """Go on from where `tensors` was called, after that many frames and updates; before the first `update`."""
        assert not self._processes, "the workers are under way"
        for part, name in PLACES.items():
            for key, tensor in part_of(self.shared, part).items():
                if key != "navigation.sights_drawn" or f"{name}.{key}" in tensors:  # not in checkpoints of before
                    tensor.copy_(tensors[f"{name}.{key}"])
        self.statistics.load_tensors(part_of(tensors, "statistics"))
        self.frames, self.updates = frames, updates

    def fixed_tensors(self) -> dict[str, Tensor]:
        """The map that prepares features."""
        return joined({"features": self.feature_map.tensors()})

    def close(self) -> None:
        """End the processes and wait for them; those that do not end by themselves are killed."""
        for connection in self._connections:
            connection.close()
        deadline = time.monotonic() + SECONDS_TO_END
        for process in self._processes:
            process.join(max(0.0, deadline - time.monotonic()))
            if process.is_alive():
                process.kill()
                process.join()
            process.close()
        self._processes, self._connections = [], []

    def _start(self) -> None:
        """Start the processes where the workers stand."""
        check_program()
        self.shared["frames"].zero_()
        self.shared["frames"][-1] = self.frames
        context = get_context("spawn")
        parts = torch.tensor_split(_by_target(self.learner.envs, self.world.target_count), self.process_count)
        with signals_held(signal.SIGINT, signal.SIGTERM):
            for number, workers in enumerate(parts):
                ours, theirs = context.Pipe()
                assignment = Assignment(
                    number,
                    tuple(workers.tolist()),
                    self.world.scene_names,
                    self.learner,
                    self.reward,
                    self.seed,
                    self.shared,
                )
                process = ChildProcess(target=work, args=(assignment, theirs), name=f"a3c-{number}", daemon=True)
                self._connections.append(ours)
                try:
                    process.start()
                except OSError as error:
                    raise RunError(
                        f"a3c's worker process {number + 1} of {len(parts)} cannot be started ({error}). "
                        "Give fewer --threads, or free some memory"
                    ) from error
                self._processes.append(process)
                theirs.close()

    def _tell(self, message: Message) -> None:
        for number, connection in enumerate(self._connections):
            try:
                connection.send(message)
            except ConnectionError:
                raise self._death(number) from None

    def _messages(self) -> Iterator[WorkerReport | Message]:
        """At least one message of the processes."""
        ready = wait(self._connections)
        for number, connection in enumerate(self._connections):
            if connection in ready:
                try:
                    yield connection.recv()
                except (EOFError, ConnectionError):
                    raise self._death(number) from None

    def _death(self, number: int) -> RunError:
        """What to say of a process whose connection is closed."""
        process = self._processes[number]
        process.join(SECONDS_TO_END)
        code = process.exitcode
        how = f"was killed by {signal.Signals(-code).name}" if code is not None and code < 0 else f"ended with {code}"
        return RunError(
            f"a3c's worker process {number + 1} of {len(self._processes)} {how} after {self.frames} frames; "
            "the others were stopped. Give --resume to go on from the last checkpoint"
        )

    def _add(self, report: WorkerReport) -> None:
        """Count a report in.

        Raises:
            RunError: its loss or gradient is not finite.
        """
        self.frames += report.frames
        self.updates += report.updates
        totals = torch.from_numpy(report.totals)
        self.statistics.totals += totals
        self.statistics.window += totals[:, : self.statistics.window.shape[1]]
        self.statistics.refresh_success()
        self._reports.append(report)
        check_finite(report.figures, self.frames)


def _by_target(workers: int, targets: int) -> Tensor:
    """Numbers of all workers, (N,) int64, ordered by target and hence by scene; worker i begins with i modulo M."""
    return torch.argsort(torch.arange(workers) % targets, stable=True)


def _mean(reports: list[WorkerReport]) -> Figures:
    """Means of figures over all updates of the reports."""
    updates = sum(report.updates for report in reports)
    return {name: sum(each.figures[name] * each.updates for each in reports) / updates for name in reports[0].figures}
