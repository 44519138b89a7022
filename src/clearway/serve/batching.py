"""Concurrent requests through the model together: while one batch is computed, the next one gathers.

Axis letters: B batch, K history, F features, A actions.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from clearway.deploy.model import AgentModel, ModelOutput
from clearway.serve.faults import Fault
from clearway.serve.limits import Limits


@dataclass(frozen=True, eq=False)
class Waiting:
    """A picture that waits for the model.

    Attributes:
        seen: (height, width, 3) uint8.
        history: (K, F) float32, or None where the picture begins an episode.
        target: (F,) float32, or None where the picture is one.
        answer: of one row.
    """

    seen: np.ndarray
    history: np.ndarray | None
    target: np.ndarray | None
    answer: asyncio.Future[ModelOutput]


class Batcher:
    """Gathers what waits into batches; one is computed at a time, in a thread, and nobody waits for a fuller one.

    Args:
        model: the agent.
        limits: how many pictures wait and go together.
        watch: told of every batch: pictures, and the seconds that the model took.
    """

    def __init__(self, model: AgentModel, limits: Limits, watch: Callable[[int, float], None]) -> None:
        self._model, self._limits, self._watch = model, limits, watch
        self._waiting: deque[Waiting] = deque()
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="model")
        self._worker: asyncio.Task[None] | None = None

    @property
    def waiting(self) -> int:
        """Pictures that wait."""
        return len(self._waiting)

    async def step(self, seen: np.ndarray, history: np.ndarray | None, target: np.ndarray | None) -> ModelOutput:
        """What the model makes of one picture, its row alone; see `Waiting`. Forgotten when cancelled.

        Raises:
            Fault: too many wait.
        """
        if len(self._waiting) >= self._limits.waiting:
            raise Fault("overloaded", "too many pictures wait for the agent. Try again")
        asked = Waiting(seen, history, target, asyncio.get_running_loop().create_future())
        self._waiting.append(asked)
        if self._worker is None or self._worker.done():
            self._worker = asyncio.create_task(self._work())
        return await asked.answer

    async def _work(self) -> None:
        """Compute batches until nothing waits."""
        loop = asyncio.get_running_loop()
        while batch := self._next_batch():
            try:
                steps, seconds = await loop.run_in_executor(self._thread, self._compute, batch)
            except Exception as fault:  # the model's fault is its askers', not the next batch's
                for asked in batch:
                    if not asked.answer.done():
                        asked.answer.set_exception(fault)
                continue
            self._watch(len(batch), seconds)
            for asked, step in zip(batch, steps, strict=True):
                if not asked.answer.done():
                    asked.answer.set_result(step)

    def _next_batch(self) -> list[Waiting]:
        """Those that have waited longest, of one picture size; empty where nobody waits."""
        live = [asked for asked in self._waiting if not asked.answer.done()]
        batch = [asked for asked in live if asked.seen.shape == live[0].seen.shape][: self._limits.batch]
        chosen = set(map(id, batch))
        self._waiting = deque(asked for asked in live if id(asked) not in chosen)
        return batch

    def _compute(self, batch: list[Waiting]) -> tuple[list[ModelOutput], float]:
        card, begun = self._model.card, time.perf_counter()
        blank = np.zeros((card.history_length, card.feature_count), np.float32)
        step = self._model.step(
            np.stack([asked.seen for asked in batch]),
            np.array([asked.history is None for asked in batch]),
            np.stack([blank if asked.history is None else asked.history for asked in batch]),
            np.stack([blank[0] if asked.target is None else asked.target for asked in batch]),
        )
        rows = [ModelOutput(*(part[row].copy() for part in step)) for row in range(len(batch))]
        return rows, time.perf_counter() - begun
