"""The service as an application of Ray Serve, which starts replicas, watches them, and answers at one address.

    serve run clearway.serve.on_ray:application agent=bathroom.onnx tokens=tokens replicas=2

Needs the extra `ray-serve`. https://docs.ray.io/en/latest/serve/index.html
"""

from __future__ import annotations

import functools
import os
import secrets
from collections.abc import Callable
from pathlib import Path
from typing import Any

from clearway import files
from clearway.deploy.agent import DeployedAgent
from clearway.errors import ClearwayError, DeployError, install_hint
from clearway.serve.access_log import to_stderr
from clearway.serve.app import make_app
from clearway.serve.limits import MOST_REPLICAS, Limits
from clearway.serve.metrics import count_no_more, count_together
from clearway.serve.own_number import beats_in, new_folder, own_number
from clearway.serve.protection import protected
from clearway.serve.replica import Replica
from clearway.serve.run import servable_agent
from clearway.serve.service import Service
from clearway.serve.session_record import KEY_BYTES
from clearway.serve.shared_sessions import sessions_in
from clearway.serve.tokens import ALONE, Tokens, checked_token, read_tokens
from clearway.web.guard import Application

try:
    import ray
    from pydantic import BaseModel, ConfigDict, Field, ValidationError
    from ray import serve
except ImportError as error:
    raise ClearwayError(f"Ray Serve is not installed. {install_hint('ray-serve')}") from error

NAMESPACE = "serve"  # that Ray Serve looks into
MOST_NUMBERS = 2 * MOST_REPLICAS  # while new replicas take the place of old ones, both run
TOKEN_VARIABLE = "CLEARWAY_TOKEN"


class Settings(BaseModel):
    """What `application` is told; words as of `clearway serve`."""

    model_config = ConfigDict(extra="forbid")
    agent: Path
    scene: str | None = None
    tokens: Path | None = None
    replicas: int = Field(2, ge=1, le=MOST_REPLICAS)
    sessions: int = 1000
    idle_s: float = 600.0
    deadline_s: float = 10.0


def application(arguments: dict[str, str]) -> serve.Application:
    """The application by the arguments of `serve run`.

    Args:
        arguments: of `Settings`, by name.

    Raises:
        ClearwayError: one is wrong, the agent cannot be opened, or there is no token.
    """
    try:
        settings = Settings.model_validate(arguments)
    except ValidationError as fault:
        wrong = "; ".join(f"{'.'.join(map(str, each['loc']))}: {each['msg']}" for each in fault.errors())
        raise DeployError(f"{wrong}. Give {', '.join(f'{name}=' for name in Settings.model_fields)}") from fault
    limits = Limits(sessions=settings.sessions, idle_s=settings.idle_s, deadline_s=settings.deadline_s)
    if settings.tokens is not None:
        tokens = read_tokens(settings.tokens.resolve())
    elif TOKEN_VARIABLE in os.environ:
        tokens = Tokens([(ALONE, checked_token(os.environ[TOKEN_VARIABLE], f"the variable {TOKEN_VARIABLE}"))])
    else:
        raise DeployError(f"no token is set. Give tokens=FILE, or set {TOKEN_VARIABLE}")
    source = settings.agent.resolve() if settings.agent.exists() else settings.agent
    threads = max((os.cpu_count() or 1) // settings.replicas, 1)
    opened = functools.partial(servable_agent, source, settings.scene, to_stderr, threads)
    opened()  # here for the first time: a run folder is exported once, and what is wrong is said at once
    return application_of(opened, tokens, limits, settings.replicas)


def application_of(
    opened: Callable[[], DeployedAgent], tokens: Tokens, limits: Limits, count: int
) -> serve.Application:
    """The application, to be run by `ray.serve.run`; its replicas stay on this machine, where their sessions lie.

    Connects to Ray where that is not done yet.

    Args:
        opened: opens the agent; a function that can be pickled.
        tokens: one of which every request must hold.
        limits: of the whole service.
        count: of replicas.
    """
    if not ray.is_initialized():
        ray.init(namespace=NAMESPACE)
    here = {"ray.io/node-id": ray.get_runtime_context().get_node_id()}
    build = functools.partial(_replica_app, opened, tokens, limits, count)
    folder, key = new_folder(files.cache_dir().resolve() / "ray-serve"), secrets.token_bytes(KEY_BYTES)

    def built() -> Application:
        return build(folder, key)

    settings: dict[str, Any] = {
        "name": "clearway",
        "num_replicas": count,
        "max_ongoing_requests": limits.divided(count).connections,
        "ray_actor_options": {"label_selector": here},
    }
    return serve.deployment(**settings)(serve.ingress(built)()).bind()


def _replica_app(
    opened: Callable[[], DeployedAgent], tokens: Tokens, limits: Limits, count: int, folder: Path, key: bytes
) -> Application:
    """What one replica answers with."""
    number = own_number(folder, MOST_NUMBERS)
    count_no_more(folder, number)  # which another replica had before
    count_together(folder, number)
    agent = opened()
    sessions = sessions_in(folder, agent, limits, tokens, key)
    replica = Replica(number, sessions, beats_in(folder, MOST_NUMBERS), folder)
    service = Service(agent, limits.divided(count), tokens, replica)
    return protected(make_app(service), service)
