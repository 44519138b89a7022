"""Who may talk to a local service, asked of the ASGI interface itself."""

import asyncio

import pytest

from clearway.web.guard import guarded, new_token, same_token

PORT, TOKEN = 8123, "right-token"
HOST = f"127.0.0.1:{PORT}"
OWN = f"http://{HOST}"


class Asked:
    """An application that notes what reaches it, and the answer that goes out."""

    def __init__(self, path: str, *headers: tuple[str, str], kind: str = "http", port: int = PORT) -> None:
        self.seen: list[str] = []
        self.sent: list[dict] = []
        scope = {
            "type": kind,
            "path": path,
            "headers": [(name.lower().encode(), value.encode()) for name, value in headers],
        }
        asyncio.run(guarded(self.app, TOKEN, port)(scope, self.receive, self.send))

    async def app(self, scope, receive, send) -> None:
        self.seen.append(scope["path"])
        if scope["type"] == "http":
            await send({"type": "http.response.start", "status": 200, "headers": [(b"x-own", b"1")]})
            await send({"type": "http.response.body", "body": b"inside"})
        else:
            await send({"type": "websocket.accept"})

    async def receive(self) -> dict:
        raise AssertionError("the guard reads nothing")

    async def send(self, message) -> None:
        self.sent.append(message)

    @property
    def status(self) -> int:
        return self.sent[0]["status"]

    @property
    def headers(self) -> dict[str, str]:
        return {name.decode(): value.decode() for name, value in self.sent[0]["headers"]}


def test_the_page_sees_the_path_after_the_token() -> None:
    asked = Asked(f"/{TOKEN}/page/app.js", ("Host", HOST), ("Origin", OWN))
    assert (asked.status, asked.seen) == (200, ["/page/app.js"])
    assert Asked(f"/{TOKEN}/", ("Host", f"localhost:{PORT}")).seen == ["/"]


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost"])
def test_clients_leave_port_80_out(name) -> None:
    for host in (name, f"{name}:80"):
        assert Asked(f"/{TOKEN}/", ("Host", host), ("Origin", f"http://{name}"), port=80).seen == ["/"]
    assert Asked(f"/{TOKEN}/", ("Host", name)).status == 421
    assert Asked(f"/{TOKEN}/", ("Host", HOST), ("Origin", f"http://{name}")).status == 403


def test_an_address_without_its_last_slash_leads_to_the_page() -> None:
    asked = Asked(f"/{TOKEN}", ("Host", HOST))
    assert (asked.status, asked.headers["location"], asked.seen) == (308, f"/{TOKEN}/", [])
    assert asked.headers["referrer-policy"] == "no-referrer"
    assert Asked("/wrong-token", ("Host", HOST)).status == 404


def test_every_answer_keeps_the_page_to_itself() -> None:
    headers = Asked(f"/{TOKEN}/", ("Host", HOST)).headers
    assert headers["x-own"] == "1"
    assert headers["referrer-policy"] == "no-referrer"  # the address holds the token
    assert headers["x-content-type-options"] == "nosniff"
    policy = dict(part.strip().split(" ", 1) for part in headers["content-security-policy"].split(";"))
    assert policy["default-src"] == policy["frame-ancestors"] == policy["base-uri"] == policy["form-action"] == "'none'"
    assert policy["script-src"] == policy["style-src"] == policy["img-src"] == "'self'"
    assert policy["connect-src"] == f"'self' ws://127.0.0.1:{PORT} ws://localhost:{PORT}"


REFUSED = {
    "no host": (f"/{TOKEN}/", [], 421),
    "another name for this machine": (f"/{TOKEN}/", [("Host", f"evil.example:{PORT}")], 421),
    "another port": (f"/{TOKEN}/", [("Host", "127.0.0.1:80")], 421),
    "a name that begins like ours": (f"/{TOKEN}/", [("Host", f"{HOST}.evil.example")], 421),
    "two hosts": (f"/{TOKEN}/", [("Host", HOST), ("Host", "evil.example")], 421),
    "another page": (f"/{TOKEN}/", [("Host", HOST), ("Origin", "https://evil.example")], 403),
    "a page from a file": (f"/{TOKEN}/", [("Host", HOST), ("Origin", "null")], 403),
    "our page over another scheme": (f"/{TOKEN}/", [("Host", HOST), ("Origin", f"https://{HOST}")], 403),
    "our origin and another": (f"/{TOKEN}/", [("Host", HOST), ("Origin", OWN), ("Origin", "null")], 403),
    "no token": ("/", [("Host", HOST)], 404),
    "a wrong token": ("/wrong-token/", [("Host", HOST)], 404),
    "the token's beginning": (f"/{TOKEN[:-1]}/", [("Host", HOST)], 404),
    "the token later on": (f"/x/{TOKEN}/", [("Host", HOST)], 404),
    "letters beyond ASCII": ("/tökén/", [("Host", HOST)], 404),
}


@pytest.mark.parametrize(("path", "headers", "status"), REFUSED.values(), ids=REFUSED)
@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_all_others_are_refused_before_the_application(path, headers, status, kind) -> None:
    asked = Asked(path, *headers, kind=kind)
    assert asked.seen == []
    if kind == "http":
        assert asked.status == status
        assert asked.sent[1] == {"type": "http.response.body", "body": b""}
    else:
        assert asked.sent == [{"type": "websocket.close", "code": 1008}]


def test_other_kinds_of_scope_pass() -> None:
    assert Asked("/", kind="lifespan").seen == ["/"]


def test_tokens_are_long_and_never_the_same() -> None:
    tokens = {new_token() for _ in range(100)}
    assert len(tokens) == 100
    assert min(map(len, tokens)) >= 32
    assert same_token("a", "a") and not same_token("a", "b") and not same_token("", "a")
