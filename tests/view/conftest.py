import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

import clearway as package
from clearway.view.stage import Stage
from helpers.small_stage import small_stage

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(package.__file__).parents[1]), "OMP_NUM_THREADS": "1"}


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Holds the stage's runs, aware and plain, and its scene files."""
    return tmp_path_factory.mktemp("stage")


@pytest.fixture(scope="session")
def stage(folder: Path) -> Stage:
    return small_stage(folder)


@pytest.fixture(scope="session")
def address(stage: Stage, folder: Path) -> Iterator[str]:
    """Of the stage's page, served by the command itself; it has to end cleanly."""
    command = [sys.executable, "-m", "clearway", "view", folder / "aware", folder / "plain", "--scenes", folder]
    with subprocess.Popen(
        [str(word) for word in command], env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        yield process.stdout.readline().strip()
        process.terminate()
        _, err = process.communicate(timeout=60)
    assert process.returncode == 0
    assert err.splitlines() == ["clearway view, for this machine's user alone (end with Ctrl+C):"]


@pytest.fixture
def full(address: str) -> Iterator[str]:
    """The address, with as many pages open as may be."""
    with ExitStack() as pages:
        for _ in range(16):
            join(address, pages)
        yield address


def join(address: str, pages: ExitStack) -> None:
    """Open a page, as soon as the viewer has noticed that another test's is gone."""
    for _ in range(600):
        connection = pages.enter_context(connect(address.replace("http", "ws") + "live", open_timeout=60))
        try:
            connection.send("{}")
            connection.recv(timeout=60)
            return
        except ConnectionClosed:
            time.sleep(0.1)
    raise AssertionError("no page was closed")
