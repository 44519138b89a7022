"""What the service does, apart from how it is asked: sessions, targets, steps."""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from clearway.agents.selection import having_taken, most_probable
from clearway.deploy.agent import DeployedAgent, aspect_problem
from clearway.deploy.navigator import Selection, arrival_of, check_selection, decision_of, episode_seed
from clearway.errors import DeployError
from clearway.serve.attempts import Attempts
from clearway.serve.batching import Batcher
from clearway.serve.decoders import Decoders
from clearway.serve.faults import Fault
from clearway.serve.limits import Limits
from clearway.serve.metrics import Metrics
from clearway.serve.replica import BEAT_S, Replica
from clearway.serve.sessions import Answer, KeepsSessions, Progress, Session, Sessions
from clearway.serve.shares import Places
from clearway.serve.tokens import Tokens


class Service:
    """An agent for many clients.

    Args:
        agent: is asked, which must take pictures.
        limits: what is allowed.
        tokens: whose owners share it.
        replica: what it has of the others; None: it is alone.

    Raises:
        DeployError: the agent takes features.
    """

    def __init__(self, agent: DeployedAgent, limits: Limits, tokens: Tokens, replica: Replica | None = None) -> None:
        if not agent.card.takes_pictures:
            problem = f"the agent for scene {agent.card.scene} was exported without its encoder"
            raise DeployError(f"{problem}, so that it takes no pictures. Export it with its encoder")
        self.card, self.limits, self.tokens = agent.card, limits, tokens
        self.replica = replica
        self.sessions: KeepsSessions = (
            Sessions(limits, self.places(limits.sessions)) if replica is None else replica.sessions
        )
        self.decoders = Decoders(limits)
        self.attempts = Attempts(limits.wrong_tokens)
        self.bodies = self.places(limits.bodies_bytes)  # bytes of requests and messages under way
        self.pictures = self.places(limits.waiting)  # under way
        self.streams = self.places(limits.sessions)  # WebSockets that are open
        gauges = (lambda: len(self.sessions), lambda: self.waiting, lambda: self.decoders.replaced)
        self.metrics = Metrics(*gauges, None if replica is None else replica.figures)
        self.batcher = Batcher(agent, limits, self.metrics.computed)

    def places(self, most: int) -> Places:
        """Places that the owners of tokens share."""
        return Places(most, lambda: self.tokens.owners)

    @property
    def waiting(self) -> int:
        """Pictures that wait, to be decoded or for the agent."""
        return self.pictures.taken

    @property
    def ready(self) -> bool:
        """There is room for another session and another picture, and pictures are decoded; in one replica at least."""
        return self._ready or (self.replica is not None and self.replica.beats.any_ready())

    async def beat(self) -> None:
        """Tell the other replicas of this one, again and again."""
        while self.replica is not None:
            try:
                await self.replica.sessions.recount()
                ready = self._ready
            except Fault:  # sessions cannot be kept now, which a line has said
                ready = False
            self.metrics.refresh()
            self.replica.beats.beat(self.replica.number, ready)
            await asyncio.sleep(BEAT_S)

    @property
    def _ready(self) -> bool:
        return not self.sessions.full and self.waiting < self.limits.waiting and not self.decoders.stalled

    async def open(self, owner: str, selection: Selection, seed: int | None) -> Session:
        """A new session of an owner's. Raises Fault where there are too many, or the agent draws nothing."""
        try:
            check_selection(selection, self.card)
        except DeployError as fault:
            raise Fault("invalid_request", str(fault)) from fault
        return await self.sessions.open(owner, selection, seed)

    async def set_target(self, session: Session, content: bytes, episode: int | None = None) -> None:
        """Begin an episode with the picture file of a target; on a Fault, or cancelled, the session stays as it was.

        A cancellation that comes once the episode has begun is too late: it returns as if there had been none.

        Args:
            session: whose episode.
            content: of the file.
            episode: its number, from 1, where the client counts: what was begun already is not begun again.
        """
        file = _digest(content)
        async with session.turn:
            picture = None
            while True:
                before = await self.sessions.progress(session)
                if _is_repeated("episode", episode, before.episode, not before.steps and file == before.seen):
                    return
                with self._place(session.owner):
                    picture = await self._decoded(session, content) if picture is None else picture
                    seed = episode_seed(session.seed, before.episode)
                    state = await self.batcher.reset(session.owner, picture, seed)
                if await self.sessions.keep(session, before, Progress(before.episode + 1, 0, state, file)):
                    return

    async def step(self, session: Session, content: bytes, number: int | None = None) -> Answer:
        """What to do, seeing a picture file; on a Fault, or cancelled, the session stays as it was.

        A cancellation that comes once the step is walked is too late: it is answered as if there had been none.

        Args:
            session: whose agent.
            content: of the file.
            number: of the step in its episode, from 1, where the client counts: the last one, sent again as its answer
                was lost, is answered as before and not walked twice.
        """
        file = _digest(content)
        async with session.turn:
            picture = None
            while True:
                before = await self.sessions.progress(session)
                if before.state is None:
                    raise Fault("no_target", "the session has no target yet. Send its picture first")
                if _is_repeated("step", number, before.steps, file == before.seen) and before.answer is not None:
                    return before.answer
                with self._place(session.owner):
                    picture = await self._decoded(session, content) if picture is None else picture
                    decisions, state = await self.batcher.act(session.owner, picture, before.state)
                if session.selection == "argmax":
                    decisions = most_probable(decisions)
                    state = having_taken(decisions.action, state)
                answer = Answer(decision_of(decisions), arrival_of(decisions), before.steps + 1)
                if await self.sessions.keep(
                    session, before, Progress(before.episode, answer.step, state, file, answer)
                ):
                    return answer

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


def _is_repeated(what: str, number: int | None, reached: int, is_same: bool) -> bool:
    """Whether a request is the last one again, by its number and its file. Raises Fault where it is not the next."""
    if number is None or number == reached + 1:
        return False
    if number == reached and is_same:
        return True
    problem = f"{what} {number} was sent, and the session has had {reached} of them"
    raise Fault("out_of_order", f"{problem}. Send number {reached + 1}, or {reached} with the same file")


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).digest()
