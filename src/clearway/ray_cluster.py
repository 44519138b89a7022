"""A connection to Ray, for whatever is to be spread over several machines."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from clearway.errors import ArgumentError, RunError, install_hint

LOCAL = "local"
PATIENCE_S = 10.0  # for a cluster's address to answer; Ray by itself tries for many minutes


@contextmanager
def connected(address: str, cores: int | None = None) -> Iterator[Any]:
    """Ray, connected; disconnected in the end, and stopped where it was started here.

    Args:
        address: "local" starts Ray on this machine, "auto" finds a running cluster, or a cluster's address.
        cores: processors that Ray may use under "local"; None: all.

    Raises:
        ArgumentError: the address is no text.
        RunError: Ray is not installed, or the cluster cannot be reached.
    """
    if not isinstance(address, str):
        raise ArgumentError(f"ray={address!r:.80}: expected local, auto or a cluster's address. Give one of them")
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    os.environ.setdefault("RAY_AUTH_MODE", "token")
    try:
        import ray
    except ImportError as error:
        raise RunError(f"--ray needs Ray. {install_hint('ray')}") from error
    started_before = ray.is_initialized()
    options: dict[str, Any] = {"log_to_driver": False, "logging_level": "ERROR", "include_dashboard": False}
    if address == LOCAL:
        options["num_cpus"] = cores
    else:
        del options["include_dashboard"]
    try:
        if not started_before:
            _check_answers(address)
            ray.init(address=address, **options)
    except (OSError, OverflowError, RuntimeError, ValueError) as error:
        reason = str(error).strip().splitlines()[0]
        raise RunError(
            f"--ray {address}: no cluster to be reached ({reason}). Start one, or give --ray local"
        ) from error
    try:
        yield ray
    finally:
        if not started_before:
            ray.shutdown()


@contextmanager
def kept_connected(address: str | None, cores: int | None = None) -> Iterator[None]:
    """One connection for all that connects within; none where there is no address. Arguments as of `connected`."""
    if address is None:
        yield
        return
    with connected(address, cores):
        yield


def _check_answers(address: str) -> None:
    """Raise OSError or OverflowError where nobody listens at "host:port"; all other addresses are Ray's to judge."""
    host, _, port = address.rpartition(":")
    if host and "/" not in host and port.isdecimal():
        socket.create_connection((host, int(port)), PATIENCE_S).close()
