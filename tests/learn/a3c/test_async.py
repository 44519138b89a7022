"""Whole A3C runs in processes: ends, resumes, deaths, interruption."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from multiprocessing.context import SpawnProcess
from pathlib import Path

import numpy as np
import pytest
import torch

from clearway.errors import RunError
from clearway.learn import running, statistics, train
from clearway.learn.a3c import parent
from clearway.learn.a3c.parent import AsyncTrainer
from clearway.learn.a3c.process import WorkerReport, world_tensors
from clearway.learn.a3c.shared import SharedTensors
from clearway.learn.checkpoint import newest_checkpoint, read_network, read_progress, read_training
from clearway.learn.figures import Figures
from clearway.learn.load import load_agent
from clearway.learn.named_tensors import part_of
from clearway.learn.presets import PAPER_A3C
from clearway.learn.run_folder import RunFolder
from clearway.learn.run_record import record_of
from clearway.learn.train import RunRequest
from clearway.reward import COLLISION_AWARE, Arrival, Reward, RewardError, Term
from helpers.agents import told_after
from helpers.plain_a3c import PlainA3C
from helpers.small_runs import equal_bits, small_learner, small_network, small_request, small_world

needs_proc = pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="looks for processes in /proc")


def a3c_request(frames: int) -> RunRequest:
    return small_request(learner=small_learner(PAPER_A3C, frames=frames, rollout_steps=5))


def async_trainer(frames: int, processes: int) -> AsyncTrainer:
    request = a3c_request(frames)
    return AsyncTrainer(small_world(), request.learner, request.paid, 3, processes)


def test_a_term_that_its_processes_cannot_import_is_refused() -> None:
    @dataclass(frozen=True)
    class Inner(Term):
        pass

    with pytest.raises(RewardError, match="its term Inner stands inside a function, which worker processes cannot"):
        AsyncTrainer(small_world(), a3c_request(1000).learner, Reward("inner", (Inner(), Arrival())), 3)


def test_figures_are_means_over_updates() -> None:
    reports = [WorkerReport(15, 3, np.zeros(0), {"loss": 1.0}), WorkerReport(5, 1, np.zeros(0), {"loss": 5.0})]
    assert parent._mean(reports) == {"loss": 2.0}


def children_of(process: int) -> list[int]:
    """Worker processes of a process; multiprocessing's own helper is none."""
    found = [int(pid) for pid in Path(f"/proc/{process}/task/{process}/children").read_text().split()]
    return [pid for pid in found if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]


def are_gone_soon(processes: list[int]) -> bool:
    """Within 30 s none of them runs any more."""
    deadline = time.monotonic() + 30
    while any(Path(f"/proc/{pid}").exists() and "Z" not in state_of(pid) for pid in processes):
        if time.monotonic() > deadline:
            return False
        time.sleep(0.05)
    return True


def state_of(process: int) -> str:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return "Z"


@pytest.mark.slow
def test_one_process_repeats_and_resumes_bit_for_bit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    request = a3c_request(400)
    whole = train.train(request, tmp_path / "whole")
    parts = RunFolder(tmp_path / "parts")
    with monkeypatch.context() as patch:
        go_on = AsyncTrainer.update

        def update(trainer: AsyncTrainer) -> Figures:
            if trainer.frames >= 150:
                signal.raise_signal(signal.SIGINT)
            return go_on(trainer)

        patch.setattr(AsyncTrainer, "update", update)
        with pytest.raises(KeyboardInterrupt):
            train.train(request, parts.path)
    assert 150 <= read_progress(newest_checkpoint(parts.checkpoints)).frames < 400
    train.train(request, parts.path, resume=True)
    ends = [newest_checkpoint(folder.checkpoints) for folder in (whole, parts)]
    assert equal_bits(*[read_network(end) for end in ends])
    assert equal_bits(*[read_training(end) for end in ends])
    progress = read_progress(ends[0])
    assert 400 <= progress.frames < 450  # ten workers of five steps: the round that reaches the budget is finished
    counts = [sum(row["episodes"] for row in folder.metrics()) for folder in (whole, parts)]
    assert counts[0] == counts[1] > 0  # rows fall elsewhere: workers walk on until they pause for a checkpoint
    assert whole.metrics()[-1]["lr"] < whole.metrics()[0]["lr"] <= PAPER_A3C.lr_start
    world = small_world()
    agent = load_agent(whole.path).on_poses(world)
    probabilities = told_after(agent, world, torch.zeros(2, 4, dtype=torch.int64), torch.tensor([0, 2]))
    assert torch.allclose(probabilities.sum(1), torch.ones(2))


@pytest.mark.slow
def test_one_process_learns_and_counts_what_plain_a3c_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(statistics, "WINDOW", 1)
    learner = small_learner(PAPER_A3C, frames=300, rollout_steps=5, step_limit=200, lr_start=0.05, centre_features=True)
    world = small_world()
    reward = learner.paid(COLLISION_AWARE)
    with closing(AsyncTrainer(world, learner, reward, 3)) as trainer:
        while not trainer.finished:
            trainer.update()
    prepared = replace(world, features=trainer.feature_map(world.features))
    plain = PlainA3C(prepared, learner, reward, 3, workers=[0, 5, 1, 6, 2, 7, 3, 8, 4, 9])
    plain.begin(small_network(world, seed=3))
    frames = 0
    while frames < learner.frames:
        frames += plain.round(frames)
    assert trainer.frames == frames
    plain.assert_learnt(part_of(trainer.shared, "parameters"), part_of(trainer.shared, "squares"))
    ended, reached = (torch.zeros(5) for _ in range(2))
    for worker in plain.workers:
        ended[worker.target] += worker.ended
        reached[worker.target] += worker.reached
    assert trainer.statistics.totals[:, :2].tolist() == torch.stack([ended, reached], 1).tolist()
    assert torch.equal(ended, reached), "no episode was cut"
    assert trainer.statistics.solved == int((ended > 0).sum()) > 0


@pytest.fixture
def two_processes() -> Iterator[AsyncTrainer]:
    with closing(async_trainer(10_000_000, processes=2)) as trainer:
        trainer.update()
        yield trainer


@pytest.mark.slow
def test_pauses_go_on_and_a_killed_worker_is_named(two_processes: AsyncTrainer) -> None:
    trainer = two_processes
    numbers = [process.pid for process in trainer._processes]
    before = {name: tensor.clone() for name, tensor in trainer.tensors().items()}
    frames = trainer.frames
    time.sleep(0.2)
    assert equal_bits(before, trainer.tensors()), "a worker went on while paused"
    assert trainer.frames == frames == int(trainer.shared["frames"].sum())
    trainer.update()
    assert trainer.frames >= frames + trainer.frames_per_update
    os.kill(numbers[1], signal.SIGKILL)
    with pytest.raises(RunError, match=r"process 2 of 2 was killed by SIGKILL after \d+ frames.*--resume"):
        while True:
            trainer.update()
    trainer.close()
    assert are_gone_soon([number for number in numbers if number])


RUN = """
import sys
from pathlib import Path
import torch
from clearway.learn.train import train
from helpers.small_runs import small_learner, small_request
from clearway.learn.presets import PAPER_A3C
torch.set_num_threads(2)
train(small_request(learner=small_learner(PAPER_A3C, frames=10_000_000, rollout_steps=5)), Path(sys.argv[1]))
"""


def run_until_metrics(folder: Path) -> tuple[subprocess.Popen, list[int]]:
    """A run of its own process group that has written metrics, and its workers."""
    process = subprocess.Popen(
        [sys.executable, "-c", RUN, str(folder)],
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": ":".join(sys.path)},
        start_new_session=True,
    )
    deadline = time.monotonic() + 200
    while len(workers := children_of(process.pid)) < 2 or not all(has_begun(pid) for pid in workers):
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return process, workers


def has_begun(process: int) -> bool:
    """The worker has begun: it maps the shared memory."""
    return "clearway-a3c" in Path(f"/proc/{process}/maps").read_text()


@pytest.mark.slow
@needs_proc
def test_workers_do_not_outlive_a_killed_parent(tmp_path: Path) -> None:
    process, workers = run_until_metrics(tmp_path)
    with process:
        process.kill()
    assert are_gone_soon(workers)


@pytest.mark.slow
@needs_proc
def test_ctrl_c_in_a_terminal_leaves_a_run_that_can_be_resumed(tmp_path: Path) -> None:
    process, workers = run_until_metrics(tmp_path)
    with process:
        os.killpg(process.pid, signal.SIGINT)  # a terminal signals all processes of the run
        _, errors = process.communicate(timeout=200)
    assert process.returncode == -signal.SIGINT
    assert errors.count("Traceback") == 1, errors  # the parent's own
    assert are_gone_soon(workers)
    trainer = a3c_request(10_000_000).trainer()
    folder = RunFolder(tmp_path)
    request = a3c_request(10_000_000)
    other_bits = folder.begin(record_of(request), resume=True)
    with pytest.warns(UserWarning, match="threads 1 instead of 2"):
        train.told_of_other_bits(folder, request, other_bits)
    train._resumed(trainer, folder)
    assert trainer.frames == read_progress(newest_checkpoint(folder.checkpoints)).frames > 0


def test_too_few_workers_are_refused() -> None:
    learner = replace(a3c_request(100).learner, envs=4)
    with pytest.raises(RunError, match="4 workers for 5 targets"):
        AsyncTrainer(small_world(), learner, COLLISION_AWARE, 0)


def test_more_processes_than_workers_are_not_started() -> None:
    assert async_trainer(100, processes=64).process_count == 10


@pytest.mark.slow
def test_a_loss_that_is_not_finite_stops_training_and_is_not_saved_either() -> None:
    """What workers report while they pause for a checkpoint does not go through an update."""
    with closing(async_trainer(10_000_000, processes=1)) as trainer:
        trainer.update()
        with pytest.raises(RunError, match="nan after"):
            for _ in range(20):  # a worker that writes just then, by what it has read before, undoes it
                trainer.shared["parameters.output_bias"][0, 4] = torch.nan
                trainer.update()
        with pytest.raises(RunError, match=r"nan after|NaN"):
            running.save(trainer, RunFolder(Path("never made")), 1.0)


def test_a_process_that_cannot_be_started_is_told_of(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: object) -> None:
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(SpawnProcess, "start", full)
    with closing(async_trainer(1000, processes=2)) as trainer:
        with pytest.raises(RunError, match=r"worker process 1 of 2 cannot be started.*unavailable.*fewer --threads"):
            trainer.update()


@pytest.mark.usefixtures("from_standard_input")
def test_a_program_that_workers_cannot_import_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="<stdin>: no file, and worker processes import the program"):
        train.train(a3c_request(400), tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_checkpoint_of_before_sights_were_drawn_is_gone_on_from() -> None:
    with closing(async_trainer(1000, processes=1)) as trainer:
        tensors = {name: tensor for name, tensor in trainer.tensors().items() if not name.endswith("sights_drawn")}
        assert len(tensors) == len(trainer.tensors()) - 1
        trainer.load_tensors(tensors, 100, 1)
        assert trainer.frames == 100


def test_shared_tensors_keep_shapes_types_and_values() -> None:
    tables = world_tensors(small_world())
    shared = SharedTensors.holding(tables)
    assert equal_bits(dict(shared), tables)
    assert [shared[name].dtype for name in tables] == [tensor.dtype for tensor in tables.values()]
    shared["world.zone"][3] = 77
    assert part_of(shared, "world")["zone"][3] == 77
    tables["world.zone"][3] = 77
    assert equal_bits(dict(shared), tables)


def test_memory_that_is_not_there_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", full, raising=False)
    with pytest.raises(RunError, match="no 0 MB of memory"):
        SharedTensors.holding({"a": torch.ones(3)})


@pytest.mark.slow
def test_workers_that_walk_on_until_a_checkpoint_skip_no_milestone_and_no_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(train, "SECONDS_BETWEEN_CHECKPOINTS", 0.0)
    pause = AsyncTrainer.tensors

    def walk_on_and_pause(trainer: AsyncTrainer) -> dict[str, torch.Tensor]:
        while trainer._processes and not trainer._paused and not trainer.finished and trainer.frames % 200 < 150:
            trainer.update()
        return pause(trainer)

    monkeypatch.setattr(AsyncTrainer, "tensors", walk_on_and_pause)
    milestones = range(80, 600, 130)
    folder = train.train(a3c_request(600), tmp_path, milestones=milestones)
    for frames in milestones:
        assert read_progress(newest_checkpoint(folder.milestone(frames))).frames >= frames
    ended = read_progress(newest_checkpoint(folder.checkpoints))
    last = folder.metrics()[-1]
    assert (last["frames"], last["updates"]) == (ended.frames, ended.updates)
