"""Workers that are killed: training goes on, nothing is learnt twice, and no process is left."""

import logging
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from clearway.children import ChildProcess
from clearway.errors import RunError
from clearway.learn.checkpoint import newest_checkpoint, read_network, read_progress, read_training
from clearway.learn.crew import END_S, INTERFACE, launched
from clearway.learn.presets import PAPER_A3C
from clearway.learn.run_folder import RunFolder
from clearway.learn.workers import train_by_workers
from clearway.scenes.thor_v1 import write_scene
from helpers import killed_workers
from helpers.crew_processes import PATIENCE_S, wait_until, workers_of
from helpers.ends_slowly import ENDS, EndsSlowly
from helpers.made import corridor_scene
from helpers.one_fails import WORDS, OneFails
from helpers.one_is_late import LOST, OneIsLate
from helpers.one_is_late import PATIENCE_S as LATE_AFTER_S
from helpers.small_runs import equal_bits, small_learner, small_request, small_scenes

KILLS = int(os.environ.get("CLEARWAY_KILLS", "5"))


def started(folder: Path, *scenes: Path) -> subprocess.Popen[str]:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", "helpers.killed_workers", str(folder), *map(str, scenes)]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment)


def all_workers_of(process: subprocess.Popen[str]) -> list[int]:
    """Of a training, once all of them are there."""
    found: list[int] = []

    def there() -> bool:
        found[:] = workers_of(process.pid)
        return len(found) == killed_workers.WORKERS

    wait_until(there, process)
    return found


def frames_of(folder: RunFolder) -> int:
    found = sorted(path.name for path in folder.checkpoints.glob("frames-*"))
    return int(found[-1].removeprefix("frames-")) if found else 0


def gone(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except (FileNotFoundError, ProcessLookupError):
        return True


def without_times(folder: RunFolder) -> list[dict[str, float]]:
    left_out = {"seconds", "slowest_worker", "slowest_factor"}
    return [{name: value for name, value in row.items() if name not in left_out} for row in folder.metrics()]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="finds the workers in /proc")
def test_workers_killed_again_and_again_learn_the_same_bits(tmp_path: Path) -> None:
    whole, killed = RunFolder(tmp_path / "whole"), RunFolder(tmp_path / "killed")
    undisturbed = started(whole.path)
    _, errors = undisturbed.communicate(timeout=PATIENCE_S)
    assert undisturbed.returncode == 0 and not errors

    moments, process = random.Random(1), started(killed.path)
    for number in range(KILLS):
        if number % 3:  # else at any moment from the start of their processes on
            before = frames_of(killed)
            wait_until(lambda before=before: frames_of(killed) > before, process)
        time.sleep(moments.uniform(0, 0.1))
        workers = all_workers_of(process)
        if number == KILLS // 2:  # the parent: its workers end with it, and the run is taken up again
            process.kill()
            process.communicate()
            deadline = time.monotonic() + 10
            while not all(map(gone, workers)):
                assert time.monotonic() < deadline
                time.sleep(0.01)
            process = started(killed.path)
        else:
            os.kill(moments.choice(workers), signal.SIGKILL)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0, errors
    assert "Traceback" not in errors and "go on from the newest checkpoint" in errors

    ends = [newest_checkpoint(folder.checkpoints) for folder in (whole, killed)]
    assert [read_progress(end).updates for end in ends] == [killed_workers.UPDATES] * 2
    assert equal_bits(*[read_network(end) for end in ends])
    assert equal_bits(*[read_training(end) for end in ends])
    assert without_times(whole) == without_times(killed)


def mapped_by(workers: Sequence[int], cache: Path) -> list[set[str]]:
    """Which files below a folder each worker has mapped."""
    lines = [[line.split() for line in Path(f"/proc/{worker}/maps").read_text().splitlines()] for worker in workers]
    return [{words[5] for words in own if words[5:] and words[5].startswith(str(cache))} for own in lines]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="finds the workers in /proc")
def test_a_worker_that_is_started_again_maps_the_same_features_and_learns_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    scenes = [tmp_path / f"{scene.name}.h5" for scene in small_scenes()]
    for scene, path in zip(small_scenes(), scenes, strict=True):
        write_scene(scene, path)
    whole, killed = RunFolder(tmp_path / "whole"), RunFolder(tmp_path / "killed")
    request = replace(killed_workers.request(scenes), scenes=small_scenes(), feature_store="memory")
    train_by_workers(request, whole.path, killed_workers.WORKERS, threads=1)

    process, found = started(killed.path, *scenes), []
    for _ in range(2):
        before = frames_of(killed)
        wait_until(lambda before=before: frames_of(killed) > before, process)
        workers = all_workers_of(process)
        found += mapped_by(workers, tmp_path / "cache")
        if len(found) == killed_workers.WORKERS:
            os.kill(workers[1], signal.SIGKILL)
            wait_until(lambda workers=workers: all(map(gone, workers)), process)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0 and "go on from the newest checkpoint" in errors, errors
    assert len(found) == 4 and found[1:] == found[:-1] and all(path.endswith("/features") for path in found[0])
    assert len(found[0]) == 1
    assert list((tmp_path / "cache/mapped").iterdir()) == []
    assert equal_bits(*[read_training(newest_checkpoint(folder.checkpoints)) for folder in (whole, killed)])


def test_what_several_workers_cannot_train_is_refused_before_a_folder_is_made(tmp_path: Path) -> None:
    refused = {
        "3 workers for 2 scenes": (small_request(), 3),
        "a3c is trained by one worker": (small_request(learner=small_learner(PAPER_A3C)), 2),
        "scenes_at_once": (small_request(learner=small_learner(scenes_at_once=1)), 2),
        "goals=seen": (small_request(learner=small_learner(goals="seen")), 2),
    }
    for told, (request, workers) in refused.items():
        with pytest.raises(RunError, match=told):
            train_by_workers(request, tmp_path / "run", workers)
    assert not (tmp_path / "run").exists()


def test_workers_without_a_gpu_for_each_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clearway.learn.train.usable_device", torch.device)
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 1)
    with pytest.raises(RunError, match=r"2 workers on 1 GPU: each needs one of its own\. Give fewer"):
        train_by_workers(small_request(device="cuda"), tmp_path / "run", 2)
    assert not (tmp_path / "run").exists()


@pytest.mark.usefixtures("from_standard_input")
def test_workers_of_a_program_that_is_no_file_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="<stdin>: no file, and worker processes import the program"):
        train_by_workers(small_request(), tmp_path / "run", 2)
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_an_error_of_one_worker_ends_all_with_its_words(tmp_path: Path) -> None:
    request = small_request(learner=small_learner(lr_start=1e30))
    began = time.monotonic()
    with pytest.raises(RunError, match="Training stopped; lower the learning rate"):
        train_by_workers(request, tmp_path / "run", 2, threads=1)
    assert time.monotonic() - began < PATIENCE_S
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_an_error_of_one_worker_is_heard_by_those_who_wait_for_it(tmp_path: Path) -> None:
    began = time.monotonic()
    assert launched(OneFails(tmp_path, os.getpid(), 1, "cpu", {}), 2) == [WORDS, WORDS]
    assert time.monotonic() - began < PATIENCE_S


@pytest.mark.slow
@pytest.mark.parametrize("end", ENDS)
def test_workers_leave_at_once_whatever_their_processes_would_do_at_the_end(tmp_path: Path, end: str) -> None:
    began = time.monotonic()
    assert launched(EndsSlowly(tmp_path, os.getpid(), 1, "cpu", {}, end), 2) == [None, None]
    assert time.monotonic() - began < PATIENCE_S


@pytest.mark.slow
def test_who_is_told_to_end_while_workers_are_started_leaves_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[ChildProcess] = []
    start = ChildProcess.start

    def one_is_started(child: ChildProcess) -> None:
        if started:
            signal.raise_signal(signal.SIGTERM)
        start(child)
        started.append(child)

    monkeypatch.setattr(ChildProcess, "start", one_is_started)
    with pytest.raises(KeyboardInterrupt):
        launched(OneFails(tmp_path, os.getpid(), 1, "cpu", {}), 2)
    assert [child.exitcode for child in started] == [-signal.SIGKILL]


@pytest.mark.slow
@pytest.mark.parametrize(("late", "outcome"), [("reads_s", None), ("thinks_s", LOST)])
def test_who_reads_for_long_is_waited_for_and_who_does_not_answer_is_not(
    tmp_path: Path, late: str, outcome: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(INTERFACE, raising=False)
    seconds = {"reads_s": 0.0, "thinks_s": 0.0} | {late: 1.5 * LATE_AFTER_S}
    assert launched(OneIsLate(tmp_path, os.getpid(), 1, "cpu", {}, **seconds), 2)[1] == outcome
    assert INTERFACE not in os.environ
    elastic = [name for name in logging.root.manager.loggerDict if name.startswith("torch.distributed.elastic")]
    assert elastic and not all(logging.getLogger(name).level == logging.CRITICAL for name in elastic)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["ctrl_c", "timeout"])
def test_a_signal_to_all_leaves_a_run_that_one_worker_ends(tmp_path: Path, number: signal.Signals) -> None:
    scenes, out = [tmp_path / f"{name}.h5" for name in ("one", "two")], tmp_path / "run"
    for scene in scenes:
        write_scene(corridor_scene(5), scene)
    small = ["--frames", "40000", "--set", "envs=20", "rollout_steps=8", "width=16", "--threads", "1", "--resume"]
    command = [sys.executable, "-m", "clearway", "train", *map(str, scenes), "--out", str(out), *small]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen([*command, "--workers", "2"], stderr=subprocess.PIPE, text=True, env=environment) as process:
        wait_until(lambda: (out / "metrics.jsonl").exists() and RunFolder(out).metrics(), process)  # an update is done
        workers = workers_of(process.pid)
        with pytest.raises(RunError, match="another process trains here"), RunFolder(out).held():
            pass
        told = time.monotonic()
        for _ in range(2 if number == signal.SIGINT else 1):  # by somebody impatient
            for pid in (*workers, process.pid):  # as a terminal does, or a program that ends a process group
                with suppress(ProcessLookupError):  # it has ended
                    os.kill(pid, number)
            time.sleep(0.02)
        _, errors = process.communicate(timeout=PATIENCE_S)
    assert time.monotonic() - told < END_S / 2  # nobody had to be killed
    assert process.returncode == 130, errors
    assert errors.rstrip().endswith("interrupted") and "Traceback" not in errors
    assert len(workers) == 2 and all(map(gone, workers))
    assert 0 < frames_of(RunFolder(out)) < 40_000
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=PATIENCE_S)
    assert done.returncode == 0, done.stderr
    assert frames_of(RunFolder(out)) == 40_000
