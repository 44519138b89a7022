"""Several workers on a Ray cluster of this machine. Slow: starting a cluster takes some ten seconds."""

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from clearway.errors import RunError
from clearway.learn import ray_workers
from clearway.learn.checkpoint import newest_checkpoint, read_network, read_training
from clearway.learn.run_folder import RunFolder
from clearway.learn.workers import train_by_workers
from clearway.perception.eyes import read_card
from clearway.pretraining.eyes_folder import EyesFolder
from clearway.pretraining.trainer import PretrainRequest
from clearway.pretraining.workers import pretrain_by_workers
from helpers.killed_pretraining import SETTINGS, made
from helpers.on_ray import MARKS, cluster_here
from helpers.small_runs import equal_bits, small_learner, small_request
from helpers.spread_parts import descends_from

pytestmark = MARKS
UPDATES = 60


@pytest.fixture(scope="module", autouse=True)
def _one_cluster() -> Iterator[None]:
    with cluster_here(2):
        yield


def trained(out: Path, where: str | None = "local") -> None:
    request = small_request(learner=small_learner(frames=80 * UPDATES))
    train_by_workers(request, out, 2, threads=1, checkpoint_s=0.0, ray=where)


def training_processes() -> list[int]:
    found = []
    for status in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            pid = int(status.parent.name)
            if b"ray::_worker" in status.read_bytes() and descends_from(pid, os.getpid()):  # others' tests have theirs
                found.append(pid)
        except (FileNotFoundError, ProcessLookupError):
            continue
    return found


def test_a_worker_that_is_killed_on_ray_changes_no_bit(tmp_path: Path) -> None:
    here, there = RunFolder(tmp_path / "here"), RunFolder(tmp_path / "there")
    trained(here.path, None)
    killed: list[int] = []

    def kill() -> None:
        deadline = time.monotonic() + 300
        while not killed and time.monotonic() < deadline:
            if len(list(there.checkpoints.glob("frames-*"))) > 1 and (found := training_processes()):
                with suppress(ProcessLookupError):  # it has ended: another look
                    os.kill(found[-1], signal.SIGKILL)
                    killed.append(found[-1])
            time.sleep(0.005)

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    trained(there.path)
    killer.join()
    assert killed
    ends = [newest_checkpoint(folder.checkpoints) for folder in (here, there)]
    assert equal_bits(*map(read_network, ends)) and equal_bits(*map(read_training, ends))
    assert [row["frames"] for row in here.metrics()] == [row["frames"] for row in there.metrics()]


def test_eyes_that_ray_trains_are_those_of_one_machine(tmp_path: Path) -> None:
    request = PretrainRequest(made(tmp_path / "views"), SETTINGS, seed=3)
    folders = {where: EyesFolder(tmp_path / str(where)) for where in (None, "local")}
    for where, folder in folders.items():
        pretrain_by_workers(request, folder.path, 2, threads=1, ray=where)
    here, there = (newest_checkpoint(folder.checkpoints) for folder in folders.values())
    assert equal_bits(read_network(here), read_network(there))
    assert read_card(folders["local"].path).trained["pictures"] == SETTINGS.pictures


def test_what_ray_cannot_run_is_told_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ray_workers, "ROOM_S", 2.0)
    with pytest.raises(RunError, match="no room for 2 workers of 2 CPU each within 2 s"):
        train_by_workers(small_request(), tmp_path / "run", 2, threads=2, ray="local")
    monkeypatch.setattr(ray_workers, "package_versions", lambda: dict.fromkeys(ray_workers.SAME, "0.1"))
    with pytest.raises(
        RunError, match=r"^the Ray node [0-9.]+ has python .* instead of 0\.1, .*Install the same there"
    ):
        train_by_workers(small_request(), tmp_path / "run", 2, threads=1, ray="local")
    assert not (tmp_path / "run").exists()
