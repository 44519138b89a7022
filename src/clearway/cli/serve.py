"""`clearway serve`."""

from __future__ import annotations

import functools
import os
import socket
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from ipaddress import ip_address
from pathlib import Path
from typing import Annotated

import tyro

from clearway.cli.console import say
from clearway.errors import ClearwayError

TOKEN_VARIABLE = "CLEARWAY_TOKEN"
UNENCRYPTED = (
    "WARNING: NOT ENCRYPTED. Tokens and pictures cross the network in the clear; whoever listens can use them. "
    "Give --tls-cert and --tls-key, or put a proxy with TLS before the service"
)
NOTABLE_BYTES = 100_000_000  # of all sessions: what is less is not worth a line


@dataclass(frozen=True)
class Serve:
    """Serve a trained agent over HTTP and WebSocket: pictures in, actions out.

    Every request needs the token that is printed; the variable CLEARWAY_TOKEN sets one of your own, --tokens several.

    Example: clearway serve runs/bathroom --port 8000
    """

    agent: Annotated[Path, tyro.conf.Positional]
    """The run folder, a file that clearway export wrote, or generalist, which comes with clearway."""
    scene: str | None = None
    """Name of the scene that the agent is for; by default the run's first."""
    host: str = "127.0.0.1"
    """Address to listen on. The default is reached from this machine alone; others need a token of yours, and TLS."""
    port: int = 0
    """Port to listen on; 0 for any that is free."""
    tokens: Path | None = None
    """File of tokens, a name and a token a line, instead of the one that is printed; clients share by name."""
    tls_cert: Path | None = None
    """Certificate for TLS, in PEM, with those that it rests on."""
    tls_key: Path | None = None
    """Its key, in PEM, without a password."""
    health_port: int | None = None
    """Port for /health, /ready and /metrics alone, without a token; by default the service's own answers them."""
    health_host: str = "127.0.0.1"
    """Address for --health-port. The default is reached from this machine alone; who reaches it needs no token."""
    trusted_proxy: str | None = None
    """Address of a proxy before the service, whose X-Forwarded-For says who asks; nobody else's is believed."""
    log_requests: bool = False
    """Write a line of JSON to standard error for every answer, twenty a second at most."""
    sessions: int = 1000
    """Sessions that may be open at a time."""
    idle_s: float = 600.0
    """Seconds after which a session expires that nobody uses."""
    deadline_s: float = 10.0
    """Seconds that a request may take."""
    replicas: int = 1
    """Processes that answer at the one address, at most 16; sessions go on when one of them dies."""

    def run(self) -> None:
        """Load the agent, then answer until interrupted."""
        from clearway.serve.access_log import to_stderr
        from clearway.serve.hangup import rotating
        from clearway.serve.limits import MOST_REPLICAS, Limits
        from clearway.serve.replicas import run_replicas
        from clearway.serve.run import Network, check_tls, run_service, servable_agent
        from clearway.serve.sessions import state_bytes
        from clearway.serve.tokens import ALONE, Tokens, checked_token, read_tokens
        from clearway.web.guard import new_token
        from clearway.web.local import address_of, is_loopback, listening, port_of

        proxy = _proxy(self.trusted_proxy)
        limits = Limits(sessions=self.sessions, idle_s=self.idle_s, deadline_s=self.deadline_s)
        if not 1 <= self.replicas <= MOST_REPLICAS:
            problem = f"--replicas is {self.replicas}, expected 1 to {MOST_REPLICAS}"
            raise ClearwayError(f"{problem}. Give about as many as there are cores")
        check_tls(self.tls_cert, self.tls_key)
        own = os.environ.get(TOKEN_VARIABLE)
        if self.tokens is not None:
            tokens = read_tokens(self.tokens)
        else:
            token = checked_token(own or new_token(), f"the variable {TOKEN_VARIABLE}")
            tokens = Tokens([(ALONE, token)])
        agent = servable_agent(self.agent, self.scene, say)
        with listening(self.port, self.host) as listener, self._health() as health:
            if health is not None and port_of(health) == port_of(listener):  # at two addresses both could have it
                raise ClearwayError(f"--health-port is {self.health_port}, as --port is. Give another")
            local, scheme = is_loopback(listener), "http" if self.tls_cert is None else "https"
            if not local and self.tokens is None and not own:
                problem = f"--host {self.host} is reached by others, and no token of yours is set"
                raise ClearwayError(f"{problem}. Set {TOKEN_VARIABLE}, or name a file by --tokens")
            say(f"scene {agent.card.scene}: {address_of(listener, self.host, scheme)}")
            if not local and scheme == "http":
                say(UNENCRYPTED)
            if health is not None:
                say(f"health and metrics, without a token: {address_of(health, self.health_host, scheme)}")
            if self.tokens is None and not own:
                say(f"token: {token}")
            if not agent.card.tells_arrival:
                say("arrived is null in all answers: an earlier clearway exported this file. Export it again")
            each = state_bytes(agent)
            if limits.sessions * each > NOTABLE_BYTES:
                whole = limits.sessions * each / 1e6
                where = "memory" if self.replicas == 1 else "in the cache folder"
                say(f"{where}: {each / 1e3:.0f} kB a session, up to {whole:.0f} MB for {limits.sessions}")
            log = to_stderr if self.log_requests else None
            network = Network(listener, health, self.tls_cert, self.tls_key, proxy, log)
            if self.replicas > 1:
                threads = max((os.cpu_count() or 1) // self.replicas, 1)
                del agent  # the replicas open it for themselves
                opened = functools.partial(servable_agent, self.agent, self.scene, to_stderr, threads)
                return run_replicas(opened, network, tokens, self.tokens, limits, self.replicas)
            with rotating(tokens, self.tokens):
                run_service(agent, network, tokens, limits)

    def _health(self) -> AbstractContextManager[socket.socket | None]:
        from clearway.web.local import LOOPBACK, listening

        if self.health_port is not None:
            return listening(self.health_port, self.health_host, "health-")
        if self.health_host != LOOPBACK:
            raise ClearwayError(f"--health-host is {self.health_host}, and there is no --health-port. Give both")
        return nullcontext()


def _proxy(given: str | None) -> str | None:
    """An address, written as connections have it. Raises ClearwayError where it is none."""
    if given is None:
        return None
    try:
        return str(ip_address(given))
    except ValueError as fault:
        problem = f"--trusted-proxy {given!r:.80}: expected the IP address of one proxy, such as 10.0.0.2"
        raise ClearwayError(f"{problem}. Give that, not a name or a network") from fault
