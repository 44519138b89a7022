"""Concurrent requests through the agent together: while one batch is computed, the next one gathers.

Axis letters: B batch.
"""

from __future__ import annotations

import asyncio
import time
from collections import Counter, deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from clearway.agents.agent import Agent, Decisions, State, joined, rows
from clearway.scenes.sensors import RGB
from clearway.serve.faults import Fault
from clearway.serve.limits import Limits
from clearway.serve.shares import Shares

Answer = tuple[Decisions | None, State]  # of one row; without decisions where an episode has begun


@dataclass(frozen=True, eq=False)
class Waiting:
    """A picture that waits for the agent.

    Attributes:
        owner: whose it is; who has used the agent least lately comes first.
        seen: (height, width, 3) uint8, of a target where an episode is to begin.
        state: of one row: what the agent remembers; or (1,) int64, the seed of the episode that is to begin.
        answer: of one row.
    """

    owner: str
    seen: np.ndarray
    state: State | np.ndarray
    answer: asyncio.Future[Answer]

    @property
    def kind(self) -> tuple[bool, tuple[int, ...]]:
        """What has to be equal in a batch."""
        return isinstance(self.state, np.ndarray), self.seen.shape


class Batcher:
    """Gathers what waits into batches; one is computed at a time, in a thread, and nobody waits for a fuller one.

    Args:
        agent: sees colour pictures.
        limits: how many pictures wait and go together.
        watch: told of every batch: pictures, and the seconds that the agent took.
    """

    def __init__(self, agent: Agent, limits: Limits, watch: Callable[[int, float], None]) -> None:
        self._agent, self._limits, self._watch = agent, limits, watch
        self._waiting: deque[Waiting] = deque()
        self._shares = Shares()
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="agent")
        self._worker: asyncio.Task[None] | None = None

    @property
    def waiting(self) -> int:
        """Pictures that wait."""
        return len(self._waiting)

    async def reset(self, owner: str, target: np.ndarray, seed: np.ndarray) -> State:
        """The state of an episode's begin, of one row, from the target's picture and a seed (1,); as `act`."""
        return (await self._answered(owner, target, seed))[1]

    async def act(self, owner: str, seen: np.ndarray, state: State) -> tuple[Decisions, State]:
        """What the agent does, seeing one picture, its row alone. Forgotten when cancelled.

        Raises:
            Fault: too many wait.
        """
        decisions, after = await self._answered(owner, seen, state)
        assert decisions is not None, "an agent that acts decides"
        return decisions, after

    async def _answered(self, owner: str, seen: np.ndarray, state: State | np.ndarray) -> Answer:
        if self.waiting >= self._limits.waiting:
            raise Fault("overloaded", "too many pictures wait for the agent. Try again")
        asked = Waiting(owner, seen, state, asyncio.get_running_loop().create_future())
        self._waiting.append(asked)
        if self._worker is None or self._worker.done():
            self._worker = asyncio.create_task(self._work())
        try:
            return await asked.answer
        except asyncio.CancelledError:  # its picture takes no place any more
            self._waiting = deque(each for each in self._waiting if each is not asked)
            raise

    async def _work(self) -> None:
        """Compute batches until nothing waits."""
        loop = asyncio.get_running_loop()
        while batch := self._next_batch():
            try:
                answers, seconds = await loop.run_in_executor(self._thread, self._compute, batch)
            except Exception as fault:  # the agent's fault is its askers', not the next batch's
                for asked in batch:
                    if not asked.answer.done():
                        asked.answer.set_exception(fault)
                continue
            self._watch(len(batch), seconds)
            for asked in batch:
                self._shares.add(asked.owner, seconds / len(batch))
            for asked, answer in zip(batch, answers, strict=True):
                if not asked.answer.done():
                    asked.answer.set_result(answer)

    def _next_batch(self) -> list[Waiting]:
        """Of one kind, in turns of their owners, of each those that have waited longest; empty where nobody waits."""
        live = [asked for asked in self._waiting if not asked.answer.done()]
        used = {asked.owner: self._shares.used(asked.owner) for asked in live}
        first = min(live, key=lambda asked: used[asked.owner], default=None)
        batch = _in_turns([asked for asked in live if first and asked.kind == first.kind], used)[: self._limits.batch]
        chosen = set(map(id, batch))
        self._waiting = deque(asked for asked in live if id(asked) not in chosen)
        return batch

    def _compute(self, batch: list[Waiting]) -> tuple[list[Answer], float]:
        begun = time.perf_counter()
        seen = {RGB: np.stack([asked.seen for asked in batch])}
        seeds = [asked.state for asked in batch if isinstance(asked.state, np.ndarray)]
        states = [asked.state for asked in batch if not isinstance(asked.state, np.ndarray)]
        decisions: Decisions | None = None
        if seeds:
            after = self._agent.reset(seen, np.concatenate(seeds))
        else:
            decisions, after = self._agent.act(seen, joined(states))
        own = [np.array([row]) for row in range(len(batch))]  # by index, which copies: no answer keeps its batch alive
        answers: list[Answer] = [(decisions and decisions.rows(row), rows(after, row)) for row in own]
        return answers, time.perf_counter() - begun


def _in_turns(asked: list[Waiting], used: dict[str, float]) -> list[Waiting]:
    """One of each owner, then the second of each and so on; who has used the least comes first."""
    before = Counter[str]()
    places = []
    for each in asked:
        places.append((before[each.owner], used[each.owner]))
        before[each.owner] += 1
    return [asked[number] for number in sorted(range(len(asked)), key=places.__getitem__)]
