"""What the service does, apart from how it is asked: sessions, targets, steps."""

from __future__ import annotations

import asyncio
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from clearway.agents.selection import most_probable
from clearway.deploy.agent import DeployedAgent, aspect_problem
from clearway.deploy.navigator import Decision, Selection, arrival_of, check_selection, decision_of
from clearway.errors import DeployError
from clearway.serve.batching import Batcher
from clearway.serve.decoding import decoded
from clearway.serve.faults import Fault
from clearway.serve.limits import Limits
from clearway.serve.metrics import Metrics
from clearway.serve.sessions import Session, Sessions


@dataclass(frozen=True)
class Answer:
    """A decision, whether the agent holds that it has arrived (None: it cannot tell), and the step's number, from 1."""

    decision: Decision
    arrived: bool | None
    step: int


class Service:
    """An agent for many clients.

    Args:
        agent: is asked, which must take pictures.
        limits: what is allowed.

    Raises:
        DeployError: the agent takes features.
    """

    def __init__(self, agent: DeployedAgent, limits: Limits) -> None:
        if not agent.card.takes_pictures:
            problem = f"the agent for scene {agent.card.scene} was exported without its encoder"
            raise DeployError(f"{problem}, so that it takes no pictures. Export it with its encoder")
        self.card, self.limits, self.sessions = agent.card, limits, Sessions(limits)
        self.metrics = Metrics(lambda: len(self.sessions), lambda: self.batcher.waiting)
        self.batcher = Batcher(agent, limits, self.metrics.computed)
        self.streams = asyncio.Semaphore(limits.sessions)  # WebSockets that may be open
        self._decoders = ThreadPoolExecutor(os.cpu_count() or 1, thread_name_prefix="decoder")

    @property
    def ready(self) -> bool:
        """There is room for another session and another picture."""
        return not self.sessions.full and self.batcher.waiting < self.limits.waiting

    def open(self, selection: Selection, seed: int | None) -> Session:
        """A new session. Raises Fault where there are too many, or the agent draws nothing."""
        try:
            check_selection(selection, self.card)
        except DeployError as fault:
            raise Fault("invalid_request", str(fault)) from fault
        return self.sessions.open(selection, seed)

    async def set_target(self, session: Session, content: bytes) -> None:
        """Begin an episode with the picture file of a target; on a Fault the session stays as it was."""
        async with session.turn:
            picture = await self._decoded(content)
            session.state = await self.batcher.reset(picture, session.seed)
            session.steps, session.seed = 0, next(session.seeds)

    async def step(self, session: Session, content: bytes) -> Answer:
        """What to do, seeing a picture file; on a Fault, or cancelled, the session stays as it was."""
        async with session.turn:
            if session.state is None:
                raise Fault("no_target", "the session has no target yet. Send its picture first")
            decisions, session.state = await self.batcher.act(await self._decoded(content), session.state)
            session.steps += 1
            if session.selection == "argmax":
                decisions = most_probable(decisions)
            return Answer(decision_of(decisions), arrival_of(decisions), session.steps)

    async def _decoded(self, content: bytes) -> np.ndarray:
        loop = asyncio.get_running_loop()
        picture = await loop.run_in_executor(self._decoders, decoded, content, self.limits.picture_pixels)
        if problem := aspect_problem(picture, self.card):
            raise Fault("unsupported_picture", problem)
        return picture
