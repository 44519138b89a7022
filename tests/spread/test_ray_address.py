"""An address at which no Ray cluster listens, told at once: Ray itself tries for many minutes."""

import socket
import sys
from types import SimpleNamespace

import pytest

from clearway.errors import RunError
from clearway.ray_cluster import connected


@pytest.fixture
def addresses(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What a Ray of straw was asked to connect to."""
    asked: list[str] = []
    straw = SimpleNamespace(
        is_initialized=lambda: False, init=lambda address, **_: asked.append(address), shutdown=lambda: None
    )
    monkeypatch.setitem(sys.modules, "ray", straw)
    return asked


@pytest.mark.parametrize("port", [None, 0, 99999])
def test_an_address_where_nobody_listens_is_one_line_at_once(addresses: list[str], port: int | None) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        closed = server.getsockname()[1]
    address = f"127.0.0.1:{closed if port is None else port}"
    with (
        pytest.raises(RunError, match=f"^--ray {address}: no cluster to be reached .*Start one") as error,
        connected(address),
    ):
        pass
    assert "\n" not in str(error.value)
    assert addresses == []


def test_an_address_where_somebody_listens_and_those_without_a_port_are_rays(addresses: list[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"127.0.0.1:{server.getsockname()[1]}"
        for wanted in (address, "auto", "local", "ray://10.0.0.1:10001"):
            with connected(wanted):
                pass
    assert addresses == [address, "auto", "local", "ray://10.0.0.1:10001"]
