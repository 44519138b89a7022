"""A service from start to a clean end."""

from __future__ import annotations

import logging
import socket
from collections.abc import Callable
from pathlib import Path

from clearway.deploy.agent import DeployedAgent
from clearway.deploy.navigator import open_agent
from clearway.serve.app import make_app
from clearway.serve.connections import impatient
from clearway.serve.limits import Limits
from clearway.serve.protection import protected
from clearway.serve.service import Service
from clearway.serve.tokens import Tokens
from clearway.web.local import serve

OTHER_FILES = 200  # beside connections that a service may open
SEND_BUFFER_BYTES = 64 * 1024  # of the system for each connection: a client that does not read is noticed soon


def servable_agent(source: Path, scene: str | None, tell: Callable[[str], object]) -> DeployedAgent:
    """The agent of an exported file, the generalist, or that of a run folder, which is exported to the cache first.

    Args:
        source: the file, "generalist" or the folder.
        scene: see `open_agent`.
        tell: see `cached_agent`.

    Raises:
        ClearwayError: see `open_agent` and `cached_agent`.
    """
    if not source.is_dir():
        return open_agent(source, scene)
    from clearway.deploy.cached import cached_agent
    from clearway.deploy.from_run import load_run_in_scene

    return cached_agent(load_run_in_scene(source, scene), tell)


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


def run_service(agent: DeployedAgent, listener: socket.socket, tokens: Tokens, limits: Limits) -> None:
    """Answer until told to end (SIGINT, SIGTERM); requests under way are answered, streams are closed.

    Args:
        agent: is asked.
        listener: from `web.local.listening`; closed at the end.
        tokens: one of which every request must hold.
        limits: what is allowed.

    Raises:
        DeployError: the agent takes no pictures.
    """
    service = Service(agent, limits, tokens)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
    http, sockets = impatient(limits.patience_s)
    serve(
        protected(make_app(service), service),
        listener,
        lifespan="on",
        http=http,
        ws=sockets,
        ws_max_size=limits.body_bytes,
        ws_per_message_deflate=False,
        limit_concurrency=allowed_connections(limits.connections),
        timeout_keep_alive=limits.patience_s,
        timeout_graceful_shutdown=int(limits.deadline_s) + 1,
    )
