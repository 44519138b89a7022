"""Sessions: each with an episode and draws of its own; expired ones go."""

from __future__ import annotations

import asyncio
import secrets
import time
from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from clearway.agents.agent import State
from clearway.deploy.agent import DeployedAgent
from clearway.deploy.navigator import Selection, episode_seeds
from clearway.scenes.sensors import RGB
from clearway.serve.faults import Fault
from clearway.serve.limits import Limits

ID_BYTES = 16


@dataclass(eq=False)
class Session:
    """One agent on its way.

    Attributes:
        id: what clients call it by; nobody can guess another's.
        selection: how its actions are chosen.
        seed: of its next episode, (1,) int64.
        seeds: of the episodes after that, one after the other.
        state: what the agent remembers, of one row; None until there is a target.
        steps: answered since the target was set.
        used_s: when it was last asked for, on the clock of its `Sessions`.
        turn: held while a request of the session is answered, so that they are answered one after the other.
    """

    id: str
    selection: Selection
    seed: np.ndarray
    seeds: Iterator[np.ndarray]
    used_s: float
    state: State | None = None
    steps: int = 0
    turn: asyncio.Lock = field(default_factory=asyncio.Lock)


def state_bytes(agent: DeployedAgent) -> int:
    """What an agent's memory of one episode takes, which every session with a target keeps."""
    height, width = agent.card.picture_size or (1, 1)
    state = agent.reset({RGB: np.zeros((1, height, width, 3), np.uint8)}, np.zeros(1, np.int64))
    return sum(values.nbytes for values in state.values())


class Sessions:
    """All open sessions.

    Args:
        limits: how many, and how long they live unused.
        clock: seconds, monotonic.
    """

    def __init__(self, limits: Limits, clock: Callable[[], float] = time.monotonic) -> None:
        self._limits, self._clock = limits, clock
        self._open: OrderedDict[str, Session] = OrderedDict()  # the one unused for longest comes first

    def __len__(self) -> int:
        self._expire()
        return len(self._open)

    @property
    def full(self) -> bool:
        """No more can be opened."""
        return len(self) >= self._limits.sessions

    def open(self, selection: Selection, seed: int | None) -> Session:
        """A new session. Raises Fault where there are too many."""
        if self.full:
            raise Fault(
                "too_many_sessions", f"{self._limits.sessions} sessions are open. Close one, or try again later"
            )
        seeds = episode_seeds(seed)
        made = Session(secrets.token_urlsafe(ID_BYTES), selection, next(seeds), seeds, self._clock())
        self._open[made.id] = made
        return made

    def get(self, session_id: str) -> Session:
        """An open session, whose time begins anew. Raises Fault where there is none of that name."""
        self._expire()
        found = self._open.get(session_id)
        if found is None:
            raise Fault("no_such_session", "no such session, or it has expired. Open a new one")
        found.used_s = self._clock()
        self._open.move_to_end(session_id)
        return found

    def close(self, session_id: str) -> None:
        """End a session. Raises Fault where there is none of that name."""
        del self._open[self.get(session_id).id]

    def _expire(self) -> None:
        oldest = self._clock() - self._limits.idle_s
        while self._open and next(iter(self._open.values())).used_s <= oldest:
            self._open.popitem(last=False)
