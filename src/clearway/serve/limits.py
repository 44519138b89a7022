"""What the service allows, all in one place."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field, replace

from clearway.errors import DeployError
from clearway.serve.shares import MOST_SHARES

MOST_REPLICAS = 16  # no more than `wrong_tokens`, of which each replica looks at one at least


@dataclass(frozen=True)
class Limits:
    """Bounds on what strangers can make the service do.

    Raises:
        DeployError: a bound is not positive and finite, or a session could expire while one of its requests is
            answered.
    """

    body_bytes: int = 4 << 20
    """Of a request, and of a WebSocket message."""
    picture_pixels: int = 1920 * 1080
    """Height times width, read from the picture's header before it is decoded."""
    picture_scans: int = 100
    """Of a JPEG, counted before it is decoded; progressive ones have some ten."""
    decode_s: float = 0.25
    """Of processor time to decode a picture; what takes longer is tried once more, slowly."""
    slow_decode_s: float = 2.0
    """Of processor time to decode a picture slowly, by a process that yields to all others; then it is refused."""
    stall_s: float = 5.0
    """After which a decoder that says nothing is ended and replaced."""
    decoder_bytes: int = 512 << 20
    """Of address space for a decoder."""
    sessions: int = 1000
    """That are open at a time."""
    idle_s: float = 600.0
    """After which a session expires that nobody uses."""
    deadline_s: float = 10.0
    """For a whole request, from its headers to its answer; for a WebSocket message, from its arrival."""
    patience_s: float = 5.0
    """For a client to send a request's headers, and to read what waits for it."""
    waiting: int = 256
    """Pictures that wait to be decoded or for the model; more are refused at once."""
    batch: int = 16
    """Pictures that go through the model together."""
    connections: int = 1500
    """That are open at a time."""
    strangers: int = 300
    """Connections of an address on which no right token has come yet; the oldest makes room for the next. As many may
    come from a fleet behind one address at once."""
    wrong_tokens: int = 20
    """Of an address in a minute; beyond, only tokens are looked at that have come from there before."""
    bodies_bytes: int = 256 << 20
    """Of all requests under way together; owners of tokens share it."""
    decoders: int = field(default_factory=lambda: os.cpu_count() or 1)
    """Processes that decode pictures quickly, and one more for owners who have used them least."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise DeployError(f"{name} is {value}, expected more than 0. Give a larger number")
            if value == math.inf:
                raise DeployError(f"{name} is inf, expected a finite number. Give a smaller number")
        if self.idle_s <= 2 * self.deadline_s:
            problem = f"sessions expire after {self.idle_s:g} s and requests may take {self.deadline_s:g} s"
            raise DeployError(f"{problem}. Let sessions live more than twice as long as requests")

    def divided(self, replicas: int) -> Limits:
        """Of one of several replicas, which share all but their sessions evenly.

        Each has one of everything at least, and bytes for the largest body of any name, whose part is the smallest
        there is, with a quarter of it for what else is held. So they may have more together than one service alone.
        """
        shared = ("waiting", "connections", "strangers", "wrong_tokens", "bodies_bytes", "decoders")
        parts = {name: max(getattr(self, name) // replicas, 1) for name in shared}
        least_bytes = MOST_SHARES * (self.body_bytes + self.body_bytes // 4)
        parts["bodies_bytes"] = max(parts["bodies_bytes"], min(least_bytes, self.bodies_bytes))
        return replace(self, **parts)
