"""Whole runs: files, interruption, resuming."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from clearway.errors import RunError
from clearway.learn import checkpoint, running, train
from clearway.learn.checkpoint import Progress, newest_checkpoint, read_network, read_progress, read_training
from clearway.learn.figures import Figures
from clearway.learn.presets import PAPER_A2C
from clearway.learn.run_folder import RunFolder
from clearway.learn.run_record import record_of
from clearway.learn.trainer import Trainer
from clearway.reward import SHORTEST
from clearway.scenes.features import FileFeatures
from clearway.scenes.scene import Scene
from clearway.scenes.thor_v1 import read_scene, write_scene
from helpers.small_runs import equal_bits, small_learner, small_request, small_scenes


def without_seconds(folder: RunFolder) -> list[dict[str, float]]:
    return [{name: value for name, value in row.items() if name != "seconds"} for row in folder.metrics()]


def interrupt_at(monkeypatch: pytest.MonkeyPatch, frames: int, number: int = signal.SIGINT) -> None:
    """Send the signal in the middle of the update that reaches `frames`."""
    whole = Trainer.update

    def update(trainer: Trainer) -> Figures:
        if trainer.frames + trainer.frames_per_update == frames:
            signal.raise_signal(number)
        return whole(trainer)

    monkeypatch.setattr(Trainer, "update", update)


def test_a_run_leaves_record_metrics_and_checkpoint(tmp_path: Path) -> None:
    request = small_request()
    folder = train.train(request, tmp_path / "run")
    assert folder.read_record().same_experiment(record_of(request))
    rows = folder.metrics()
    assert [row["frames"] for row in rows] == [80 * k for k in range(1, 11)]
    assert {"seconds", "episodes", "success", "solved_targets", "loss", "entropy", "lr"} <= set(rows[0])
    progress = read_progress(newest_checkpoint(folder.checkpoints))
    assert (progress.frames, progress.updates) == (800, 10)
    assert progress.seconds == pytest.approx(rows[-1]["seconds"], abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["default", "paper"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_resumes_to_the_same_bits(
    preset: str, number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    request = small_request()
    if preset == "paper":
        request = replace(request, learner=small_learner(PAPER_A2C))
    whole = train.train(request, tmp_path / "whole")
    before = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)}
    with monkeypatch.context() as patch:
        interrupt_at(patch, 480, number)
        with pytest.raises(KeyboardInterrupt):
            train.train(request, tmp_path / "parts")
    assert {n: signal.getsignal(n) for n in before} == before
    parts = RunFolder(tmp_path / "parts")
    assert read_progress(newest_checkpoint(parts.checkpoints)).frames == 480  # the update was finished and saved
    train.train(request, tmp_path / "parts", resume=True)
    ends = [newest_checkpoint(folder.checkpoints) for folder in (whole, parts)]
    assert equal_bits(*[read_network(end) for end in ends])
    assert equal_bits(*[read_training(end) for end in ends])  # optimiser, streams, episodes, statistics
    assert without_seconds(whole) == without_seconds(parts)


@pytest.mark.slow
def test_resuming_from_an_earlier_checkpoint_cuts_the_metrics_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    request, out = small_request(), tmp_path / "run"
    monkeypatch.setattr(train, "SECONDS_BETWEEN_CHECKPOINTS", 0.0)
    whole = train.train(request, tmp_path / "whole")
    folder = train.train(request, out)
    newest = newest_checkpoint(folder.checkpoints)
    (newest / "training.safetensors").write_bytes(b"torn")
    with pytest.warns(UserWarning, match="an earlier checkpoint is used"):
        train.train(request, out, resume=True)
    assert without_seconds(folder) == without_seconds(whole)
    assert equal_bits(*[read_network(newest_checkpoint(f.checkpoints)) for f in (whole, folder)])


@pytest.mark.slow
def test_resuming_a_finished_run_touches_no_file(tmp_path: Path) -> None:
    folder = train.train(small_request(), tmp_path)

    def stamps() -> dict[Path, tuple[int, int]]:
        files = [path for path in tmp_path.rglob("*") if path.is_file() and path.name != ".lock"]
        return {path: (path.stat().st_ino, path.stat().st_mtime_ns) for path in files}

    before = stamps()
    assert folder.metrics_path in before and newest_checkpoint(folder.checkpoints) / "network.safetensors" in before
    train.train(small_request(), tmp_path, resume=True)
    assert stamps() == before


@contextmanager
def stopped_already() -> Iterator[threading.Event]:
    event = threading.Event()
    event.set()
    yield event


def test_a_run_that_is_stopped_before_it_went_on_keeps_its_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        interrupt_at(patch, 480)
        with pytest.raises(KeyboardInterrupt):
            train.train(small_request(), tmp_path)
    saved = newest_checkpoint(RunFolder(tmp_path).checkpoints)
    number = (saved / "network.safetensors").stat().st_ino
    with monkeypatch.context() as patch:
        patch.setattr(train, "interruption", stopped_already)
        with pytest.raises(KeyboardInterrupt):
            train.train(small_request(), tmp_path, resume=True)
    assert newest_checkpoint(RunFolder(tmp_path).checkpoints) == saved
    assert (saved / "network.safetensors").stat().st_ino == number


def test_no_frame_is_saved_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(train, "SECONDS_BETWEEN_CHECKPOINTS", 0.0)
    saved, save = [], running.save

    def counted(trainer: Trainer, folder: RunFolder, seconds: float) -> None:
        saved.append(trainer.frames)
        save(trainer, folder, seconds)

    monkeypatch.setattr(running, "save", counted)
    train.train(small_request(), tmp_path)
    assert saved == [80 * k for k in range(1, 11)]


def test_a_second_training_in_the_folder_is_refused_and_changes_nothing(tmp_path: Path) -> None:
    folder = train.train(small_request(learner=small_learner(frames=160)), tmp_path)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    for resume in (False, True):
        with folder.held(), pytest.raises(RunError, match="another process trains here"):
            train.train(small_request(learner=small_learner(frames=160)), tmp_path, resume=resume)
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_resume_begins_where_there_is_no_run_or_no_checkpoint_yet(tmp_path: Path) -> None:
    request = small_request(learner=small_learner(frames=160))
    folder = RunFolder(tmp_path / "killed early")
    record = record_of(request)
    folder.write_record(replace(record, versions={"torch": "0.1"}, hardware={"threads": 7}, command=("elsewhere",)))
    folder.metrics_path.write_text('{"frames": 80, "seconds": 1, "loss": 1}\n')
    train.train(request, folder.path, resume=True)
    found = folder.read_record()
    assert found.begun is not None and found.begun >= record.begun
    assert replace(found, begun=record.begun) == record  # all of it was made here
    new = train.train(request, tmp_path / "new", resume=True)
    assert without_seconds(folder) == without_seconds(new)
    assert len(new.metrics()) == 2


def test_a_folder_that_holds_a_run_is_not_begun_anew(tmp_path: Path) -> None:
    request = small_request(learner=small_learner(frames=160))
    folder = train.train(request, tmp_path)
    before = folder.metrics_path.read_text()
    with pytest.raises(RunError, match="holds a run already"):
        train.train(request, tmp_path)
    assert folder.metrics_path.read_text() == before


@pytest.mark.parametrize("name", ["metrics.jsonl", "checkpoints"])
def test_what_another_run_left_without_its_run_json_is_not_mixed_in(name: str, tmp_path: Path) -> None:
    request = small_request(learner=small_learner(frames=160))
    folder = train.train(request, tmp_path)
    (tmp_path / "run.json").unlink()
    (folder.metrics_path if name == "checkpoints" else folder.checkpoints).rename(tmp_path / "elsewhere")
    for resume in (False, True):
        with pytest.raises(RunError, match=f"holds {name} but no run.json"):
            train.train(request, tmp_path, resume=resume)


def test_resuming_another_experiment_is_refused(tmp_path: Path) -> None:
    request = small_request(learner=small_learner(frames=160))
    train.train(request, tmp_path)
    for other in (
        replace(request, seed=4),
        replace(request, reward=SHORTEST),
        replace(request, zone_level="cell"),
        replace(request, learner=small_learner(frames=160, discount=0.9)),
    ):
        with pytest.raises(RunError, match="holds another experiment"):
            train.train(other, tmp_path, resume=True)
    with pytest.raises(RunError, match="Give --frames 160"):
        train.train(replace(request, learner=small_learner(frames=80)), tmp_path, resume=True)


def test_a_full_disk_stops_the_run_and_the_checkpoint_before_it_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(train, "SECONDS_BETWEEN_CHECKPOINTS", 0.0)
    save, calls = checkpoint.save_file, []

    def full(*arguments: object) -> None:
        calls.append(arguments)
        if len(calls) > 6:  # two files a checkpoint
            raise OSError(28, "No space left on device")
        save(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(checkpoint, "save_file", full)
        with pytest.raises(RunError, match="No space left"):
            train.train(small_request(), tmp_path / "run")
    folder = RunFolder(tmp_path / "run")
    assert read_progress(newest_checkpoint(folder.checkpoints)).frames == 240
    train.train(small_request(), folder.path, resume=True)
    assert without_seconds(folder) == without_seconds(train.train(small_request(), tmp_path / "whole"))


def test_numbers_that_are_not_finite_stop_the_run_and_the_checkpoint_before_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(train, "SECONDS_BETWEEN_CHECKPOINTS", 0.0)
    whole = Trainer.update

    def update(trainer: Trainer) -> Figures:
        if trainer.updates == 2:
            with torch.no_grad():
                trainer.network.fusion_bias[0] = torch.nan
        return whole(trainer)

    monkeypatch.setattr(Trainer, "update", update)
    with pytest.raises(RunError, match="nan after 240 frames"):
        train.train(small_request(), tmp_path)
    kept = newest_checkpoint(RunFolder(tmp_path).checkpoints)
    assert read_progress(kept).frames == 160
    assert all(tensor.isfinite().all() for tensor in read_network(kept).values())


def test_parameters_that_are_not_finite_are_not_saved(tmp_path: Path) -> None:
    trainer, folder = small_request().trainer(), RunFolder(tmp_path)
    with torch.no_grad():
        trainer.network.fusion_bias[0] = torch.inf
    with pytest.raises(RunError, match=r"network\.fusion_bias holds NaN or Inf after 0 frames"):
        running.save(trainer, folder, 1.0)
    assert not folder.checkpoints.exists()


@pytest.mark.slow
def test_a_milestone_replaces_what_a_run_that_went_on_otherwise_left(tmp_path: Path) -> None:
    """Asynchronous runs come by at other frames each time, and the newest is that with the most."""
    folder = RunFolder(tmp_path)
    checkpoint.write_checkpoint(folder.milestone(160), {}, {}, Progress(240, 3, 1.0))
    train.train(small_request(), tmp_path, milestones=[160])
    assert read_progress(newest_checkpoint(folder.milestone(160))).frames == 160


RUN = """
import sys
from pathlib import Path
from clearway.learn import train
from helpers.small_runs import small_learner, small_request
train.set_threads(1)
train.train(small_request(learner=small_learner(frames=160_000)), Path(sys.argv[1]))
"""


def test_ctrl_c_leaves_a_run_that_can_be_resumed(tmp_path: Path) -> None:
    command = [sys.executable, "-c", RUN, str(tmp_path)]
    metrics = tmp_path / "metrics.jsonl"
    environment = os.environ | {"PYTHONPATH": ":".join(sys.path)}
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as process:
        deadline = time.monotonic() + 60
        while not metrics.exists() or not metrics.stat().st_size:
            assert process.poll() is None, process.stderr.read()
            assert time.monotonic() < deadline
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == -signal.SIGINT  # Python's answer to an uncaught KeyboardInterrupt
    assert errors.rstrip().endswith("KeyboardInterrupt")
    folder = RunFolder(tmp_path)
    progress = read_progress(newest_checkpoint(folder.checkpoints))
    assert progress.frames == 80 * progress.updates > 0
    request = small_request(learner=small_learner(frames=160_000))
    trainer = request.trainer()
    assert folder.begin(record_of(request), resume=True) == []
    assert train._resumed(trainer, folder) == progress.seconds
    assert Progress(trainer.frames, trainer.updates, progress.seconds) == progress


@pytest.mark.parametrize(
    ("name", "began", "said"),
    [
        ("threads", 7, "threads 1 instead of 7"),
        ("feature_store", "float16", "feature_store memory instead of float16"),
        ("device", "cuda", "device cpu instead of cuda"),
        ("gpu", "a large one", "gpu None instead of a large one"),
        ("bfloat16", "maybe", "bfloat16 (True|False) instead of maybe"),
        ("torch", "1.0", "torch .* instead of 1.0"),
    ],
)
def test_going_on_in_another_way_is_said(
    name: str, began: int | str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    torch.set_num_threads(1)
    request = small_request()
    with monkeypatch.context() as patch:
        interrupt_at(patch, 480, signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            train.train(request, tmp_path)
    folder = RunFolder(tmp_path)
    record = folder.read_record()
    kind = "versions" if name in record.versions else "hardware"
    folder.write_record(replace(record, **{kind: {**getattr(record, kind), name: began}}))
    with pytest.warns(UserWarning, match=f"{said}; results will not be those of an uninterrupted run"):
        train.train(request, tmp_path, resume=True)
    train.train(request, tmp_path, resume=True)  # nothing is left to do, so nothing to warn of


def test_a_checkpoint_without_a_tensor_is_refused_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    request = small_request()
    with monkeypatch.context() as patch:
        interrupt_at(patch, 480, signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            train.train(request, tmp_path)
    whole = train.read_training
    monkeypatch.setattr(train, "read_training", lambda path: {k: t for k, t in whole(path).items() if "drawn" not in k})
    with pytest.raises(RunError, match=r"frames-\d+: does not fit its run .*drawn.*Remove it"):
        train.train(request, tmp_path, resume=True)


def test_a_device_that_is_not_there_is_refused(tmp_path: Path) -> None:
    for name in ("nonsense", "cuda:99", "meta"):
        with pytest.raises(RunError, match=f"device {name}: cannot be used here"):
            train.train(small_request(device=name), tmp_path)


def in_files(folder: Path) -> list[Scene]:
    """The small scenes with features in their files."""
    for scene in small_scenes():
        write_scene(scene, folder / f"{scene.name}.h5")
    return [read_scene(folder / f"{scene.name}.h5", features_in_file=True) for scene in small_scenes()]


@pytest.mark.slow
def test_a_training_reads_mapped_features_once_and_resumes_to_the_bits_of_one_in_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    whole = train.train(small_request(), tmp_path / "whole")
    request = small_request(scenes=in_files(tmp_path), feature_store="mapped")
    read: list[str] = []
    features_of = FileFeatures.__array__

    def counted(features: FileFeatures, *how: Any, **more: Any) -> np.ndarray:
        read.append(features.path.stem)
        return features_of(features, *how, **more)

    monkeypatch.setattr(FileFeatures, "__array__", counted)
    with monkeypatch.context() as patch:
        interrupt_at(patch, 480)
        with pytest.raises(KeyboardInterrupt):
            train.train(request, tmp_path / "parts")
    assert sorted(read) == ["corridor", "grid"]
    parts = train.train(request, tmp_path / "parts", resume=True)
    assert sorted(read) == ["corridor", "corridor", "grid", "grid"]
    assert equal_bits(*[read_training(newest_checkpoint(folder.checkpoints)) for folder in (whole, parts)])
    assert without_seconds(whole) == without_seconds(parts)
    records = [folder.read_record() for folder in (whole, parts)]
    assert records[0].same_experiment(records[1])


def test_features_in_a_mapped_file_train_the_same_agent_bit_for_bit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CLEARWAY_CACHE", str(tmp_path / "cache"))
    for scene in small_scenes():
        write_scene(scene, tmp_path / f"{scene.name}.h5")
    parameters = {}
    for store in ("memory", "mapped", "float16"):
        paths = [tmp_path / "corridor.h5", tmp_path / "grid.h5"]
        scenes = [read_scene(path, features_in_file=store != "memory") for path in paths]
        request = small_request(scenes=scenes, feature_store=store)
        trainer = request.trainer()
        trainer.update()
        parameters[store] = dict(trainer.network.named_parameters())
        assert record_of(request).same_experiment(record_of(small_request()))
    assert equal_bits(parameters["mapped"], parameters["memory"])
    assert not equal_bits(parameters["float16"], parameters["memory"])
    torch.testing.assert_close(parameters["float16"], parameters["memory"], rtol=0.05, atol=0.01)
