"""What the service does, apart from how it is asked: sessions, targets, steps."""

from __future__ import annotations

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
from clearway.serve.shares import Places
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

        def places(most: int) -> Places:
            return Places(most, lambda: tokens.owners)

        self.card, self.limits, self.tokens = agent.card, limits, tokens
        self.sessions = Sessions(limits, places(limits.sessions))
        self.decoders = Decoders(limits)
        self.attempts = Attempts(limits.wrong_tokens)
        self.bodies = places(limits.bodies_bytes)  # bytes of requests and messages under way
        self.pictures = places(limits.waiting)  # under way
        self.streams = places(limits.sessions)  # WebSockets that are open
        self.metrics = Metrics(lambda: len(self.sessions), lambda: self.waiting, lambda: self.decoders.replaced)
        self.batcher = Batcher(agent, limits, self.metrics.computed)

    @property
    def waiting(self) -> int:
        """Pictures that wait, to be decoded or for the agent."""
        return self.pictures.taken

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
        return self.sessions.open(owner, selection, seed)

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

    @contextmanager
    def _place(self, owner: str) -> Iterator[None]:
        """A place among the pictures that wait. Raises Fault where none is free, or none for this owner."""
        if not self.pictures.take(owner):
            raise Fault("overloaded", "too many pictures wait for the agent. Try again")
        try:
            yield
        finally:
            self.pictures.free(owner)

    async def _decoded(self, session: Session, content: bytes) -> np.ndarray:
        picture = await self.decoders.decode(content, session.owner, session.standing)
        if problem := aspect_problem(picture, self.card):
            raise Fault("unsupported_picture", problem)
        return picture
