"""What the service does, apart from how it is asked: sessions, targets, steps."""

from __future__ import annotations

import asyncio
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from clearway.deploy.model import AgentModel
from clearway.deploy.navigator import Decision, choose
from clearway.errors import DeployError
from clearway.serve.batching import Batcher
from clearway.serve.faults import Fault
from clearway.serve.limits import Limits
from clearway.serve.metrics import Metrics
from clearway.serve.pictures import decoded
from clearway.serve.sessions import Session, Sessions


@dataclass(frozen=True)
class Answer:
    """A decision and its number in the episode, from 1."""

    decision: Decision
    step: int


class Service:
    """An agent for many clients.

    Args:
        model: the agent, which must take pictures.
        limits: what is allowed.

    Raises:
        DeployError: the agent takes features.
    """

    def __init__(self, model: AgentModel, limits: Limits) -> None:
        if not model.card.takes_pictures:
            problem = f"the agent for scene {model.card.scene} was exported without its encoder"
            raise DeployError(f"{problem}, so that it takes no pictures. Export it with its encoder")
        self.card, self.limits, self.sessions = model.card, limits, Sessions(limits)
        self.metrics = Metrics(lambda: len(self.sessions), lambda: self.batcher.waiting)
        self.batcher = Batcher(model, limits, self.metrics.computed)
        self.streams = asyncio.Semaphore(limits.sessions)  # WebSockets that may be open
        self._decoders = ThreadPoolExecutor(os.cpu_count() or 1, thread_name_prefix="decoder")

    @property
    def ready(self) -> bool:
        """There is room for another session and another picture."""
        return not self.sessions.full and self.batcher.waiting < self.limits.waiting

    async def set_target(self, session: Session, content: bytes) -> None:
        """Begin an episode with the picture file of a target; on a Fault the session stays as it was."""
        async with session.turn:
            step = await self.batcher.step(await self._decoded(content), None, None)
            session.target, session.history, session.steps = step.history[-1], None, 0

    async def step(self, session: Session, content: bytes) -> Answer:
        """What to do, seeing a picture file; on a Fault, or cancelled, the session stays as it was."""
        async with session.turn:
            if session.target is None:
                raise Fault("no_target", "the session has no target yet. Send its picture first")
            step = await self.batcher.step(await self._decoded(content), session.history, session.target)
            session.history, session.steps = step.history, session.steps + 1
            uniform = None if session.selection == "argmax" else session.rng.random()
            action = choose(step.probabilities, uniform)
            return Answer(Decision(action, step.probabilities, float(step.value[0])), session.steps)

    async def _decoded(self, content: bytes) -> np.ndarray:
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._decoders, decoded, content, self.limits.picture_pixels)
