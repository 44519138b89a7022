"""A client of `clearway serve`. Needs httpx, NumPy and Pillow, and nothing of the learner.

Use it as the agent itself (`clearway.Navigator`): one session is one navigator.
"""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from clearway.deploy.agent import checked_picture
from clearway.deploy.navigator import Decision, Selection, checked_seed
from clearway.errors import ClearwayError, DeployError, install_hint
from clearway.regular_files import read_bytes
from clearway.scenes.actions import ACTION_COUNT, Action

TIMEOUT_S = 30.0
AGAIN_S, FIRST_PAUSE_S = 10.0, 0.05  # after its begin, a request is sent again whose connection broke; pauses double
UNSURE = ("unreachable", "deadline_passed", "internal")  # whether a request with such an end has changed the session
BROKEN = (500, 502, 503, 504)  # status of a proxy's own answer whose replica has died meanwhile
GONE = 404  # status of what is not there: ended by a request whose answer was lost
MAX_PICTURE_BYTES = 64 * 1024**2  # of a file; the service takes less
KEEP_ALIVE_S = 3.0  # of an idle connection; the service's is longer, so that it never closes one that is used
ANSWER = ("action_index", "probabilities", "value", "arrived")  # of a step
KINDS = {b"\xff\xd8\xff": "image/jpeg", b"\x89PNG": "image/png", b"RIFF": "image/webp"}


class ServiceError(ClearwayError):
    """The service refused, or cannot be reached.

    Args:
        code: the service's code, for example "too_many_sessions"; "unreachable" where there was no answer, "status 404"
            and the like where something else answered.
        message: what it says.
    """

    def __init__(self, code: str, message: str) -> None:
        super().__init__(f"{code}: {message}")
        self.code, self.message = code, message

    def __reduce__(self) -> tuple:
        """Pickle by the constructor's arguments."""
        return type(self), (self.code, self.message)


class Client:
    """A connection to a service; threads may share it. Close it, or use it as a context.

    Args:
        url: for example "http://127.0.0.1:8000".
        token: that the service printed when it started.
        timeout_s: for one answer.

    Raises:
        ServiceError: the address or the token cannot be one.
    """

    def __init__(self, url: str, token: str, timeout_s: float = TIMEOUT_S) -> None:
        try:
            import httpx
        except ImportError as fault:
            raise ClearwayError(f"the client needs httpx. {install_hint('serve')}") from fault
        if not token or " " in token or not (token.isascii() and token.isprintable()):
            problem = "the token is empty or holds other than plain letters"
            raise ServiceError("unauthorised", f"{problem}. Give the one that the service printed when it started")
        try:
            address = httpx.URL(url)
        except httpx.InvalidURL as fault:
            problem = f"{url} is no address ({fault})"
            raise ServiceError("unreachable", f"{problem}. Give one such as http://127.0.0.1:8000") from fault
        headers = {"authorization": f"Bearer {token}"}
        limits = httpx.Limits(keepalive_expiry=KEEP_ALIVE_S)
        self._http = httpx.Client(base_url=address, headers=headers, timeout=timeout_s, limits=limits, trust_env=False)
        self._broken = (httpx.ReadError, httpx.WriteError, httpx.CloseError, httpx.RemoteProtocolError)
        self._unreachable = (httpx.HTTPError, UnicodeError)  # the latter: a host's name that cannot be looked up

    def agent(self) -> dict[str, Any]:
        """What the agent is. Raises ServiceError."""
        return self.ask_json("GET", "/agent", "scene")

    def session(self, *, selection: Selection = "sampled", seed: int | None = None) -> ClientSession:
        """Open a session; the arguments are `Navigator`'s. Raises ServiceError, DeployError.

        Where the connection breaks meanwhile, one may stay open that nobody uses, until it expires.
        """
        wanted = {"selection": selection, "seed": checked_seed(seed)}
        return ClientSession(self, self.ask_json("POST", "/sessions", "session_id", json=wanted)["session_id"])

    def ask(self, method: str, path: str, **content: Any) -> Any:
        """An answer of the service. Raises ServiceError where it refuses or cannot be reached."""
        try:
            answer, times = self._answered(method, path, content)
        except self._unreachable as fault:
            reason = str(fault).rstrip(".")
            raise ServiceError("unreachable", f"{self._http.base_url}: {reason}. Check the address") from fault
        if answer.is_success or (times > 1 and method == "DELETE" and answer.status_code == GONE):
            return answer
        try:
            kept = answer.json()["error"]
            code, message = str(kept["code"]), str(kept["message"])
        except (ValueError, KeyError, TypeError, RecursionError) as fault:
            raise self._stranger(answer.status_code) from fault
        raise ServiceError(code, message)

    def _answered(self, method: str, path: str, content: dict[str, Any]) -> tuple[Any, int]:
        """An answer, and how often it was asked for: again where the connection broke, as when a replica dies.

        So is it where a proxy before the replicas says so, as that of Ray Serve does.

        A step or target without a number is asked for once: whether it was walked, nobody could tell.
        """
        give_up, pause_s = time.monotonic() + AGAIN_S, FIRST_PAUSE_S
        may_come_twice = _may_come_twice(method, path, content)

        def may_wait() -> bool:
            return may_come_twice and time.monotonic() + pause_s <= give_up

        for times in count(1):
            try:
                answer = self._http.request(method, path, **content)
            except self._broken:
                if not may_wait():
                    raise
            else:
                if not _is_proxy_s(answer) or not may_wait():
                    return answer, times
            time.sleep(pause_s)
            pause_s *= 2
        raise AssertionError("it counts without an end")

    def ask_json(
        self, method: str, path: str, *names: str, reads: Callable[[dict[str, Any]], Any] = dict, **content: Any
    ) -> Any:
        """The JSON object of an answer, which holds these names, or what `reads` makes of it.

        Raises:
            ServiceError: as `ask`; and where there is no such object, or `reads` fails.
        """
        answer = self.ask(method, path, **content)
        try:
            found = answer.json()
            if not isinstance(found, dict) or not found.keys() >= set(names):
                raise ValueError(f"no object of {', '.join(names)}")
            return reads(found)
        except (ValueError, TypeError, OverflowError, RecursionError) as fault:  # the last: nested too deep
            raise self._stranger(answer.status_code) from fault

    def _stranger(self, status: int) -> ServiceError:
        """The error of who answers otherwise than the service would; `status`: of the answer."""
        problem = f"{self._http.base_url}: no clearway service answers there"
        return ServiceError(f"status {status}", f"{problem}. Check the address")

    def close(self) -> None:
        """Close the connection."""
        self._http.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, kind: object, fault: object, trace: object) -> None:
        self.close()


class ClientSession:
    """An agent on its way, kept by the service; see `Client.session`. Used as a context, it is closed at the end.

    Its requests are numbered: one whose answer was lost is sent again and answered, and no step is walked twice. Once
    an answer was lost for good, requests of its kind have no numbers any more and are not sent again.

    Attributes:
        arrived: whether the agent held at its last act that it is at the target; None where it cannot tell.
    """

    def __init__(self, client: Client, session_id: str) -> None:
        self.arrived: bool | None = None
        self._answered: dict[str, int | None] = {"episode": 0, "step": 0}  # None: not known to the client any more
        self._client, self.session_id, self._path = client, session_id, f"/sessions/{session_id}"

    def set_target(self, picture: object) -> None:
        """Begin an episode: walk to where this picture was taken.

        Args:
            picture: (height, width, 3) uint8 RGB or a Pillow picture, which are sent without loss; a JPEG, PNG or WebP
                file as bytes or by its path.

        Raises:
            ServiceError: the service refused it.
            DeployError: it is no picture, or a file that cannot be read.
        """
        with self._counted("episode") as number:
            self._client.ask("PUT", f"{self._path}/target", params=number, **_body(picture))
        self._answered["step"], self.arrived = 0, None

    def act(self, picture: object) -> Decision:
        """What to do, seeing a picture; kinds and errors as in `set_target`."""
        with self._counted("step") as number:
            path, content = f"{self._path}/steps", _body(picture)
            decision, self.arrived = self._client.ask_json("POST", path, *ANSWER, reads=_step, params=number, **content)
        return decision

    @contextmanager
    def _counted(self, what: str) -> Iterator[dict[str, int]]:
        """The parameter of a request that says its number. None is said once an answer has been lost for good."""
        answered = self._answered[what]
        try:
            yield {} if answered is None else {what: answered + 1}
        except ServiceError as fault:
            if fault.code in UNSURE or fault.code.startswith("status"):
                self._answered[what] = None
            raise
        except DeployError:  # no picture: nothing was sent
            raise
        except BaseException:  # Ctrl+C: the service may have answered
            self._answered[what] = None
            raise
        if answered is not None:
            self._answered[what] = answered + 1

    def close(self) -> None:
        """End the session. Raises ServiceError where it has ended already."""
        self._client.ask("DELETE", self._path)

    def __enter__(self) -> ClientSession:
        return self

    def __exit__(self, kind: object, fault: object, trace: object) -> None:
        try:
            self.close()
        except ServiceError:
            if fault is None:
                raise


def _step(answer: dict[str, Any]) -> tuple[Decision, bool | None]:
    """A step's decision, and whether the agent has arrived. Raises ValueError, TypeError, OverflowError."""
    index, told, value, arrived = (answer[name] for name in ANSWER)
    probabilities = None if told is None else np.array(told, np.float32)
    if probabilities is not None and probabilities.shape != (ACTION_COUNT,):
        raise ValueError(f"probabilities of {probabilities.shape} actions")
    if arrived is not None and not isinstance(arrived, bool):
        raise ValueError(f"arrived={arrived!r:.40}")
    return Decision(Action(index), probabilities, None if value is None else float(value)), arrived


def _is_proxy_s(answer: Any) -> bool:
    """Whether a fault is told by something before the service: the service's own are JSON."""
    kind = answer.headers.get("content-type", "")
    return answer.status_code in BROKEN and not kind.startswith("application/json")


def _may_come_twice(method: str, path: str, content: dict[str, Any]) -> bool:
    """Whether a request may be sent again: what it asks for is then not done twice, or is another session."""
    return method in ("GET", "DELETE") or path == "/sessions" or bool(content.get("params"))


def picture_file(picture: object) -> tuple[bytes, str]:
    """A picture as a file's content, and its content type; see `ClientSession.set_target` for kinds and errors."""
    if isinstance(picture, str | Path):
        picture = _content(Path(picture))
    if isinstance(picture, bytes):
        kinds = [kind for begin, kind in KINDS.items() if picture.startswith(begin)]
        return picture, kinds[0] if kinds else "image/png"
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(checked_picture(picture)).save(file, "PNG", compress_level=1)
    return file.getvalue(), "image/png"


def _body(picture: object) -> dict[str, Any]:
    """A picture as a request's content with its header."""
    content, kind = picture_file(picture)
    return {"content": content, "headers": {"content-type": kind}}


def _content(path: Path) -> bytes:
    """What a file holds. Raises DeployError where it cannot be read."""
    try:
        return read_bytes(path, MAX_PICTURE_BYTES)
    except OSError as fault:
        raise DeployError(f"{path}: cannot be read ({fault.strerror}). Name a JPEG, PNG or WebP file") from fault
