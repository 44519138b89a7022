"""A service around `Sums`, called in process."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from starlette.testclient import TestClient

from clearway.serve.app import make_app
from clearway.serve.limits import Limits
from clearway.serve.protection import protected
from clearway.serve.service import Service
from helpers.serving import TOKEN, TOKENS
from helpers.sums import Sums


@pytest.fixture
def service() -> Service:
    return Service(Sums(), Limits(picture_pixels=10_000, body_bytes=100_000, sessions=20, deadline_s=5), TOKENS)


@pytest.fixture
def called() -> Iterator[Callable[..., TestClient]]:
    """Makes a client of a service, by default with its token."""
    opened: list[TestClient] = []

    def client(service: Service, token: str | None = TOKEN) -> TestClient:
        headers = {"authorization": f"Bearer {token}"} if token else {}
        made = TestClient(protected(make_app(service), service), headers=headers)
        made.__enter__()
        opened.append(made)
        return made

    yield client
    for made in opened:
        made.__exit__()


@pytest.fixture
def client(called: Callable[..., TestClient], service: Service) -> TestClient:
    return called(service)
