"""A service from start to a clean end."""

from __future__ import annotations

import logging
import socket
import ssl
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from clearway.deploy.agent import DeployedAgent
from clearway.deploy.navigator import open_agent
from clearway.errors import ClearwayError
from clearway.serve.access_log import AccessLog, Sparing
from clearway.serve.admitted import Admitted
from clearway.serve.app import make_app
from clearway.serve.connections import Strangers
from clearway.serve.handshakes import Door, Handshakes
from clearway.serve.hangup import on_hangup, renew_certificate, tls_of
from clearway.serve.limits import Limits
from clearway.serve.messages import impatient
from clearway.serve.protection import protected
from clearway.serve.replica import Replica
from clearway.serve.service import Service
from clearway.serve.tokens import Tokens
from clearway.web.local import port_of, serve

OTHER_FILES = 200  # beside connections that a service may open
SEND_BUFFER_BYTES = 64 * 1024  # of the system for each connection: a client that does not read is noticed soon


def servable_agent(
    source: Path, scene: str | None, tell: Callable[[str], object], threads: int | None = None
) -> DeployedAgent:
    """The agent of an exported file, the generalist, or that of a run folder, which is exported to the cache first.

    Args:
        source: the file, "generalist" or the folder.
        scene: see `open_agent`.
        tell: see `cached_agent`.
        threads: of the processor, for an agent in a file; None: one a core.

    Raises:
        ClearwayError: see `open_agent` and `cached_agent`.
    """
    if not source.is_dir():
        return open_agent(source, scene, threads)
    from clearway.deploy.cached import cached_agent
    from clearway.deploy.from_run import load_run_in_scene

    return cached_agent(load_run_in_scene(source, scene), tell, threads)


def allowed_connections(wanted: int) -> int:
    """As many connections as wanted, or as the files that this process may open allow; raises that limit if need be."""
    try:
        import resource
    except ImportError:  # not Unix: no such limit
        return wanted
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    unlimited, needed = resource.RLIM_INFINITY, wanted + OTHER_FILES
    if soft == unlimited or soft >= needed:
        return wanted
    limit = needed if hard == unlimited else min(needed, hard)
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (limit, hard))
    except (OSError, ValueError):  # some systems allow less than they say
        limit = soft
    allowed = max(min(wanted, limit - OTHER_FILES), 1)
    if allowed < wanted:
        told = f"at most {allowed} connections at a time, not {wanted}: this process may open {limit} files"
        logging.getLogger("clearway.serve").warning("%s. Raise the limit, for example by ulimit -Hn", told)
    return allowed


@dataclass(frozen=True)
class Network:
    """How the service is reached.

    Attributes:
        listener: from `web.local.listening`; closed at the end.
        health: another one, for health and metrics alone, without a token; None: the first answers them.
        certificate, key: files in PEM for TLS; None: none.
        proxy: address of a proxy whose X-Forwarded-For is believed.
        log: takes a line for every answer; None: none is written.
    """

    listener: socket.socket
    health: socket.socket | None = None
    certificate: Path | None = None
    key: Path | None = None
    proxy: str | None = None
    log: Callable[[str], object] | None = None

    def listeners(self) -> list[socket.socket]:
        """Both, or the one."""
        return [self.listener, *([self.health] if self.health else [])]

    def tls(self) -> ssl.SSLContext | None:
        """By its certificate; None where it has none. Raises OSError where that cannot be read."""
        return None if self.certificate is None else tls_of(self.certificate, self.key)


def check_tls(certificate: Path | None, key: Path | None) -> None:
    """Raise ClearwayError where one of both is missing, cannot be read or does not belong to the other."""
    if certificate is None and key is None:
        return
    if certificate is None or key is None:
        raise ClearwayError("--tls-cert and --tls-key go together. Give both, in PEM")
    try:
        for path in (certificate, key):
            if not path.is_file():
                raise ClearwayError(f"{path}: is no regular file. Name a certificate and its key, in PEM")
        tls_of(certificate, key)
    except OSError as fault:  # ssl.SSLError is one
        reason = fault.strerror or fault
        raise ClearwayError(f"{certificate}, {key}: {reason}. Name a certificate and its key, in PEM") from fault


def run_service(
    agent: DeployedAgent, network: Network, tokens: Tokens, limits: Limits, replica: Replica | None = None
) -> None:
    """Answer until told to end (SIGINT, SIGTERM); requests under way are answered, streams are closed.

    SIGHUP reads the certificate again, where there is one.

    Args:
        agent: is asked.
        network: how it is reached.
        tokens: one of which every request must hold.
        limits: what is allowed.
        replica: what it has of others; None: it is alone.

    Raises:
        DeployError: the agent takes no pictures.
    """
    service = Service(agent, limits, tokens, replica)
    for listener in network.listeners():
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
    health_port = port_of(network.health) if network.health else None
    strangers = Strangers(limits.strangers, network.proxy)
    handshakes = Handshakes(limits.strangers, limits.patience_s, network.proxy)
    connections = allowed_connections(limits.connections)
    shared = (service.places(connections), service.bodies, Admitted(tokens))
    http, sockets = impatient(limits, *shared, strangers, handshakes, health_port)
    tls = network.tls()
    listeners = [Door(listener, handshakes) if tls else listener for listener in network.listeners()]
    logging.basicConfig(format="%(asctime)s %(levelname)s %(message)s", level=logging.WARNING)
    logging.getLogger("uvicorn.error").addFilter(Sparing())
    renew = partial(renew_certificate, tls, network.certificate, network.key) if tls and network.certificate else None
    with on_hangup(renew) if renew else nullcontext():
        serve(
            protected(make_app(service), service, health_port, AccessLog(network.log) if network.log else None),
            *listeners,
            tls=tls,
            proxy_headers=network.proxy is not None,
            forwarded_allow_ips=network.proxy,
            lifespan="on",
            loop="asyncio",  # others ask no `Door`
            log_config=None,
            http=http,
            ws=sockets,
            ws_max_size=limits.body_bytes,
            ws_per_message_deflate=False,
            limit_concurrency=connections,
            timeout_keep_alive=limits.patience_s,
            timeout_graceful_shutdown=int(limits.deadline_s) + 1,
        )
