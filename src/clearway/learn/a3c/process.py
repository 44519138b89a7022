"""A worker process: rounds of its workers, until its parent says otherwise, closes the connection or dies.

The parent sends PAUSE and GO; the process sends `WorkerReport`s and PAUSED. It ends with its parent: `ChildProcess`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import Enum
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
import torch
from torch import Tensor

from clearway.learn.a3c.config import A3C
from clearway.learn.a3c.group import Round, WorkerGroup
from clearway.learn.a3c.shared import SharedTensors
from clearway.learn.figures import Figures
from clearway.learn.named_tensors import part_of
from clearway.reward import Reward
from clearway.world.world import World


class Message(Enum):
    """What parent and process say beside reports."""

    PAUSE = "pause"
    PAUSED = "paused"
    GO = "go"


@dataclass(frozen=True)
class WorkerReport:
    """A `Round`, or what it came to; NumPy, because tensors sent between processes would become shared memory."""

    frames: int
    updates: int
    totals: np.ndarray
    figures: Figures


@dataclass(frozen=True)
class Assignment:
    """What a process is to do.

    Attributes:
        number: of the process, from 0.
        workers: numbers of its workers, their targets ascending.
        scene_names, learner, reward, seed: see there.
        shared: "world.*" tables, "parameters.*", "squares.*" (mean squares plus epsilon), "workers.*" (one row a
            worker), "frames" (frames used so far by each process, and before this start at the end).
    """

    number: int
    workers: tuple[int, ...]
    scene_names: tuple[str, ...]
    learner: A3C
    reward: Reward
    seed: int
    shared: SharedTensors

    def group(self) -> WorkerGroup:
        """The workers where they stand."""
        group = WorkerGroup(
            world_from(self.shared, self.scene_names),
            self.learner,
            self.reward,
            self.seed,
            torch.tensor(self.workers),
            part_of(self.shared, "parameters"),
            part_of(self.shared, "squares"),
        )
        rows = torch.tensor(self.workers)
        group.load_tensors({name: tensor[rows] for name, tensor in part_of(self.shared, "workers").items()})
        return group


def work(assignment: Assignment, connection: Connection) -> None:
    """Run a worker process."""
    torch.set_num_threads(1)
    group = assignment.group()
    try:
        _work(assignment, group, connection)
    except (EOFError, ConnectionError):  # the parent closed the connection or is gone: nothing is left to do
        return


def _work(assignment: Assignment, group: WorkerGroup, connection: Connection) -> None:
    frames = assignment.shared["frames"]
    while True:
        used = int(frames.sum())
        idle = used >= assignment.learner.frames
        if connection.poll(None if idle else 0):
            assert connection.recv() == Message.PAUSE
            _leave_state(assignment, group)
            connection.send(Message.PAUSED)
            assert connection.recv() == Message.GO
            continue
        report = group.round(used)
        frames[assignment.number] += report.frames
        connection.send(_sendable(report))


def _leave_state(assignment: Assignment, group: WorkerGroup) -> None:
    """Write where the workers stand to shared memory."""
    rows = torch.tensor(assignment.workers)
    for name, tensor in group.tensors().items():
        assignment.shared[f"workers.{name}"][rows] = tensor


def _sendable(report: Round) -> WorkerReport:
    return WorkerReport(report.frames, report.updates, report.totals.numpy(), report.figures)


def world_tensors(world: World) -> dict[str, Tensor]:
    """The tables of a world by name, for shared memory."""
    tables = {field.name: getattr(world, field.name) for field in fields(world)}
    return {f"world.{name}": table for name, table in tables.items() if isinstance(table, Tensor)}


def world_from(shared: SharedTensors, scene_names: tuple[str, ...]) -> World:
    """The world whose tables lie in shared memory."""
    tables: dict[str, Any] = part_of(shared, "world")
    return World(scene_names=scene_names, **tables)
