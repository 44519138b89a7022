"""The service's routes; OpenAPI describes them at /openapi.json."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from http import HTTPStatus
from typing import Annotated, Any

from clearway.deploy.navigator import Selection
from clearway.errors import ClearwayError, install_hint
from clearway.serve.decoding import CONTENT_TYPES
from clearway.serve.faults import INTERNAL, POLICY, STATUS, Code, Fault, FaultBody
from clearway.serve.service import Service
from clearway.serve.sessions import Answer
from clearway.serve.tokens import ANSWERED, OWNER
from clearway.version import __version__

try:
    from fastapi import FastAPI, Path, Query, Request, Security, WebSocket, WebSocketDisconnect
    from fastapi.exceptions import RequestValidationError
    from fastapi.responses import Response
    from fastapi.security import HTTPBearer
    from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
    from starlette.exceptions import HTTPException
    from starlette.requests import HTTPConnection
except ImportError as error:
    raise ClearwayError(f"clearway serve needs FastAPI. {install_hint('serve')}") from error

DESCRIPTION = """A trained agent: pictures in, actions out.

Open a session, send the picture of its target, then the picture after every step. `GET /sessions/{session_id}/stream`
is a WebSocket for the steps of a session: every binary message is a picture file, every answer the JSON of a step, or
of a refusal, after which the session goes on as it was. Where a stream broke, open the next one with `?step=` and the
number of the step that was not answered: its picture, sent again, is not walked twice.
"""
ID = r"^[A-Za-z0-9_-]{1,64}$"
MOST_SEED = (1 << 53) - 1  # JSON's exact whole numbers
Number = Annotated[int | None, Query(ge=1, le=MOST_SEED)]
"""Of a request among those of its kind; None where the client does not count them."""


def _whole(value: object) -> object:
    """JSON knows no difference between 3 and 3.0."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


class Opening(BaseModel):
    """How a session chooses its actions."""

    model_config = ConfigDict(extra="forbid", strict=True)
    selection: Selection = "sampled"
    seed: Annotated[int, Field(ge=0, le=MOST_SEED), BeforeValidator(_whole)] | None = None


class Opened(BaseModel):
    """An open session."""

    session_id: str
    expires_after_s: float


class StepAnswer(BaseModel):
    """What the agent does."""

    action: str
    action_index: int
    probabilities: list[float] | None
    value: float | None
    arrived: bool | None
    step: int


class AgentDescription(BaseModel):
    """What the agent is."""

    scene: str
    actions: list[str]
    history_length: int
    picture_size: list[int] | None
    observation: dict[str, Any] | None
    encoder: str
    tells_arrival: bool
    version: str


class State(BaseModel):
    """Whether the service is up."""

    status: str


def make_app(service: Service) -> FastAPI:
    """The application, to be put behind `protection.protected`, which says whose a request is."""
    app = FastAPI(
        title="clearway serve",
        version=__version__,
        description=DESCRIPTION,
        docs_url=None,
        redoc_url=None,
        lifespan=lambda app: _decoding(service),
    )
    token = [Security(HTTPBearer(auto_error=False))]
    _answer_faults(app, service)

    @app.get("/health", responses=_faults())
    async def health() -> State:
        """The process answers."""
        return State(status="ok")

    @app.get("/ready", responses=_faults("overloaded"))
    async def ready() -> State:
        """There is room for another session, and pictures are decoded."""
        if not service.ready:
            raise Fault("overloaded", "no room for another session or picture. Try again")
        return State(status="ready")

    @app.get("/metrics", dependencies=token, response_class=Response, responses=_METRICS)
    async def metrics() -> Response:
        """Figures for Prometheus."""
        return Response(service.metrics.text(), media_type="text/plain; version=0.0.4")

    @app.get("/agent", dependencies=token, responses=_faults("unauthorised", "too_many_attempts"))
    async def agent() -> AgentDescription:
        """What the agent is."""
        card = service.card
        return AgentDescription(
            scene=card.scene,
            actions=list(card.actions),
            history_length=card.history_length,
            picture_size=None if card.picture_size is None else list(card.picture_size),
            observation=None if card.observation is None else dict(card.observation),
            encoder=str(card.encoder.get("name")),
            tells_arrival=card.tells_arrival,
            version=__version__,
        )

    @app.post("/sessions", status_code=201, dependencies=token, responses=_faults(*OPENING))
    async def open_session(opening: Opening, request: Request) -> Opened:
        """Open a session; it expires when it is not used."""
        session = await service.open(_owner(request), opening.selection, opening.seed)
        return Opened(session_id=session.id, expires_after_s=service.limits.idle_s)

    @app.delete("/sessions/{session_id}", status_code=204, dependencies=token, responses=_faults(*CLOSING))
    async def close_session(session_id: Annotated[str, Path(pattern=ID)], request: Request) -> None:
        """End a session."""
        await service.sessions.close(session_id, _owner(request))

    @app.put(
        "/sessions/{session_id}/target",
        status_code=204,
        dependencies=token,
        responses=_faults(*PICTURE),
        openapi_extra=PICTURE_BODY,
    )
    async def set_target(
        session_id: Annotated[str, Path(pattern=ID)], request: Request, episode: Number = None
    ) -> None:
        """Begin an episode: the body is the picture of the place to walk to.

        Send the episode's number, from 1 in a session, and you may send the request again where its answer was lost.
        """
        session = await service.sessions.get(session_id, _owner(request))
        await service.set_target(session, await _picture(request), episode)

    @app.post(
        "/sessions/{session_id}/steps",
        dependencies=token,
        responses=_faults(*PICTURE, "no_target"),
        openapi_extra=PICTURE_BODY,
    )
    async def step(session_id: Annotated[str, Path(pattern=ID)], request: Request, step: Number = None) -> StepAnswer:
        """Decide: the body is what the camera sees now.

        Send the step's number, from 1 in an episode, and you may send the request again where its answer was lost.
        """
        session = await service.sessions.get(session_id, _owner(request))
        return _answer(service, await service.step(session, await _picture(request), step))

    @app.websocket("/sessions/{session_id}/stream")
    async def stream(socket: WebSocket, session_id: str, step: Number = None) -> None:
        await _stream(service, socket, session_id, step)

    return app


OPENING: tuple[Code, ...] = (
    "unauthorised",
    "too_many_attempts",
    "invalid_request",
    "too_many_sessions",
    "body_too_large",
    "too_slow",
)
CLOSING: tuple[Code, ...] = ("unauthorised", "too_many_attempts", "no_such_session", "invalid_request")
PICTURE: tuple[Code, ...] = (
    *CLOSING,
    "out_of_order",
    "unsupported_picture",
    "unreadable_picture",
    "body_too_large",
    "picture_too_large",
    "overloaded",
    "too_slow",
    "deadline_passed",
)
PICTURE_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {kind: {"schema": {"type": "string", "format": "binary"}} for kind in CONTENT_TYPES},
    }
}


def _faults(*codes: Code) -> dict[int | str, dict[str, Any]]:
    """How a route's refusals are documented."""
    found: dict[int | str, dict[str, Any]] = {}
    for code in (*codes, "internal"):
        entry = found.setdefault(int(STATUS[code]), {"model": FaultBody, "description": ""})
        entry["description"] = ", ".join(filter(None, (entry["description"], code)))
    return found


_METRICS = _faults("unauthorised", "too_many_attempts") | {
    200: {"description": "Figures", "content": {"text/plain": {}}}
}


@asynccontextmanager
async def _decoding(service: Service) -> AsyncIterator[None]:
    """Decoders run meanwhile."""
    try:
        service.decoders.start()
        beating = asyncio.create_task(service.beat())
        yield
        beating.cancel()
    finally:
        service.decoders.close()


def _owner(connection: HTTPConnection) -> str:
    """The name of the token that was sent."""
    return str(connection.scope[OWNER])


def _answer(service: Service, answer: Answer) -> StepAnswer:
    decision = answer.decision
    return StepAnswer(
        action=service.card.actions[decision.action],
        action_index=int(decision.action),
        probabilities=None if decision.probabilities is None else decision.probabilities.tolist(),
        value=decision.value,
        arrived=answer.arrived,
        step=answer.step,
    )


async def _picture(request: Request) -> bytes:
    """The body of a request that says it is a picture. Raises Fault."""
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind not in CONTENT_TYPES:
        raise Fault("unsupported_picture", f"the header Content-Type is not one of {', '.join(CONTENT_TYPES)}")
    return await request.body()


async def _stream(service: Service, socket: WebSocket, session_id: str, step: int | None) -> None:
    """Answer the pictures of a session, one after the other, until either side ends it."""
    owner = _owner(socket)
    try:
        async with _in_time(service):
            await service.sessions.get(session_id, owner)
        if not service.streams.take(owner):
            raise Fault("overloaded", "too many streams are open. Close one, or try again later")
    except Fault as fault:
        return await socket.send_denial_response(_fault_response(fault))
    try:
        await socket.accept()
        await _answer_messages(service, socket, session_id, step)
    finally:
        service.streams.free(owner)


async def _answer_messages(service: Service, socket: WebSocket, session_id: str, step: int | None) -> None:
    """The first picture is that of the step with this number, where it has one; those that follow have none."""
    try:
        while True:
            async with asyncio.timeout(service.limits.idle_s):
                message = await socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            begun, status = time.perf_counter(), int(HTTPStatus.OK)
            try:
                answer = await _answer_message(service, _owner(socket), session_id, message.get("bytes"), step)
                step = None
            except Fault as fault:
                service.metrics.faults.labels(fault.code).inc()
                answer, status = fault.body().decode(), fault.status
            await socket.send_text(answer)
            socket.scope[ANSWERED](begun, status)
            if status == HTTPStatus.NOT_FOUND:
                return await socket.close(POLICY, "the session has ended")
    except WebSocketDisconnect:
        return
    except TimeoutError:
        await socket.close(POLICY, "unused for too long")
    except Exception:
        logging.getLogger("clearway.serve").exception("a stream failed")
        await socket.close(INTERNAL, "the service failed. Its log says why")


async def _answer_message(
    service: Service, owner: str, session_id: str, content: bytes | None, step: int | None
) -> str:
    """The answer to a message. Raises Fault."""
    async with _in_time(service):
        session = await service.sessions.get(session_id, owner)
        if content is None:
            raise Fault("invalid_request", "send pictures as binary messages")
        if len(content) > service.limits.body_bytes:  # of a server that bounds messages by itself, none comes here
            raise Fault("body_too_large", f"at most {service.limits.body_bytes} bytes are taken")
        return _answer(service, await service.step(session, content, step)).model_dump_json()


@asynccontextmanager
async def _in_time(service: Service) -> AsyncIterator[None]:
    """Raises Fault where what is done meanwhile takes longer than a request may."""
    try:
        async with asyncio.timeout(service.limits.deadline_s):
            yield
    except TimeoutError as late:
        told = f"not answered within {service.limits.deadline_s:g} s. Try again"
        raise Fault("deadline_passed", told) from late


def _fault_response(fault: Fault) -> Response:
    return Response(fault.body(), fault.status, fault.headers())


def _answer_faults(app: FastAPI, service: Service) -> None:
    """Give every refusal, ours and the framework's, the same structure."""

    def refuse(fault: Fault, headers: dict[str, str] | None = None) -> Response:
        service.metrics.faults.labels(fault.code).inc()
        response = _fault_response(fault)
        response.headers.update(headers or {})
        return response

    async def ours(request: Request, fault: Exception) -> Response:
        assert isinstance(fault, Fault)
        return refuse(fault)

    async def invalid(request: Request, fault: Exception) -> Response:
        assert isinstance(fault, RequestValidationError)
        parts = [f"{'.'.join(map(str, each['loc']))}: {each['msg']}" for each in fault.errors()]
        return refuse(Fault("invalid_request", "; ".join(parts)[:500]))

    async def framework_s(request: Request, fault: Exception) -> Response:
        assert isinstance(fault, HTTPException)
        if fault.status_code == 404:
            return refuse(Fault("not_found", "there is nothing here. /openapi.json lists what there is"))
        if fault.status_code == 405:
            headers = dict(fault.headers or {})
            return refuse(Fault("method_not_allowed", "another method is needed here. See /openapi.json"), headers)
        return refuse(Fault("invalid_request", "the request cannot be read"))

    async def failed(request: Request, fault: Exception) -> Response:
        return refuse(Fault("internal", "the service failed. Its log says why"))

    handlers: dict[type[Exception], Callable[[Request, Exception], Awaitable[Response]]] = {
        Fault: ours,
        RequestValidationError: invalid,
        HTTPException: framework_s,
        Exception: failed,
    }
    for kind, handler in handlers.items():
        app.add_exception_handler(kind, handler)
