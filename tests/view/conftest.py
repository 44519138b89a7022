import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import clearway as package
from clearway.view.stage import Stage
from small_stage import small_stage

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
