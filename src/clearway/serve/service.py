"""What the service does, apart from how it is asked: sessions, targets, steps."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from clearway.agents.selection import most_probable
from clearway.deploy.agent import DeployedAgent, aspect_problem
from clearway.deploy.navigator import Decision, Selection, arrival_of, check_selection, decision_of
from clearway.errors import DeployError
from clearway.serve.attempts import Attempts
from clearway.serve.batching import Batcher
from clearway.serve.decoders import Decoders
from clearway.serve.faults import Fault
from clearway.serve.limits import Limits
from clearway.serve.metrics import Metrics
from clearway.serve.sessions import Session, Sessions
from clearway.serve.tokens import Tokens


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
        tokens: whose owners share it.

    Raises:
        DeployError: the agent takes features.
    """

    def __init__(self, agent: DeployedAgent, limits: Limits, tokens: Tokens) -> None:
        if not agent.card.takes_pictures:
            problem = f"the agent for scene {agent.card.scene} was exported without its encoder"
            raise DeployError(f"{problem}, so that it takes no pictures. Export it with its encoder")
        self.card, self.limits, self.tokens, self.sessions = agent.card, limits, tokens, Sessions(limits)
        self.decoders = Decoders(limits)
        self.attempts = Attempts(limits.wrong_tokens)
        self._bodies = Counter[str]()  # bytes of requests under way, by owner
        self._pictures = Counter[str]()  # under way, by owner
        self.metrics = Metrics(lambda: len(self.sessions), lambda: self.waiting, lambda: self.decoders.replaced)
        self.batcher = Batcher(agent, limits, self.metrics.computed)
        self.streams = asyncio.Semaphore(limits.sessions)  # WebSockets that may be open

    @property
    def waiting(self) -> int:
        """Pictures that wait, to be decoded or for the agent."""
        return self._pictures.total()

    @property
    def ready(self) -> bool:
        """There is room for another session and another picture, and pictures are decoded."""
        return not self.sessions.full and self.waiting < self.limits.waiting and not self.decoders.stalled

    def open(self, owner: str, selection: Selection, seed: int | None) -> Session:
        """A new session of an owner's. Raises Fault where there are too many, or the agent draws nothing."""
        try:
            check_selection(selection, self.card)
        except DeployError as fault:
            raise Fault("invalid_request", str(fault)) from fault
        return self.sessions.open(owner, selection, seed, self.tokens.share(self.limits.sessions))

    async def set_target(self, session: Session, content: bytes) -> None:
        """Begin an episode with the picture file of a target; on a Fault the session stays as it was."""
        async with session.turn:
            with self._place(session.owner):
                picture = await self._decoded(session, content)
                session.state = await self.batcher.reset(session.owner, picture, session.seed)
            session.steps, session.seed = 0, next(session.seeds)

    async def step(self, session: Session, content: bytes) -> Answer:
        """What to do, seeing a picture file; on a Fault, or cancelled, the session stays as it was."""
        async with session.turn:
            if session.state is None:
                raise Fault("no_target", "the session has no target yet. Send its picture first")
            with self._place(session.owner):
                picture = await self._decoded(session, content)
                decisions, session.state = await self.batcher.act(session.owner, picture, session.state)
            session.steps += 1
            if session.selection == "argmax":
                decisions = most_probable(decisions)
            return Answer(decision_of(decisions), arrival_of(decisions), session.steps)

    def hold_bytes(self, owner: str, count: int) -> None:
        """Count bytes of a body that arrives. Raises Fault where the bodies under way are too large together."""
        most = self.limits.bodies_bytes
        if self._bodies.total() + count > most or self._bodies[owner] + count > self.tokens.share(most):
            raise Fault("overloaded", "too many large requests are under way. Try again")
        self._bodies[owner] += count

    def free_bytes(self, owner: str, count: int) -> None:
        """The request whose body was counted is over."""
        self._bodies[owner] -= count

    @contextmanager
    def _place(self, owner: str) -> Iterator[None]:
        """A place among the pictures that wait. Raises Fault where none is free, or none for this owner."""
        most = self.limits.waiting
        if self.waiting >= most or self._pictures[owner] >= self.tokens.share(most):
            raise Fault("overloaded", "too many pictures wait for the agent. Try again")
        self._pictures[owner] += 1
        try:
            yield
        finally:
            self._pictures[owner] -= 1

    async def _decoded(self, session: Session, content: bytes) -> np.ndarray:
        picture = await self.decoders.decode(content, session.owner, session.standing)
        if problem := aspect_problem(picture, self.card):
            raise Fault("unsupported_picture", problem)
        return picture
