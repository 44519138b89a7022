"""A run that is copied to an object store goes on from there on another machine."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from clearway.errors import ClearwayError
from clearway.learn import run_copy
from clearway.learn import train as training
from clearway.learn.checkpoint import checkpoints, newest_checkpoint, read_network, read_training
from clearway.learn.run_copy import RunCopy
from clearway.learn.run_folder import RunFolder
from clearway.learn.trainer import Trainer
from clearway.remote.store import Store
from helpers.small_runs import equal_bits, small_learner, small_request

S3 = Callable[[str, bytes], None]
ADDRESS = "s3://rooms/runs/one"
FRAMES = 480  # six updates
REQUEST = small_request(learner=small_learner(frames=FRAMES))


class _PowerCut(BaseException):
    pass


@pytest.fixture(autouse=True)
def _every_update(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(training, "SECONDS_BETWEEN_CHECKPOINTS", 0.0)


def cut_off(folder: Path, monkeypatch: pytest.MonkeyPatch, updates: int, copy_to: str | None = ADDRESS) -> None:
    """Train until the power goes before this update."""
    whole = Trainer.update

    def update(trainer: Trainer) -> dict[str, float]:
        if trainer.updates == updates:
            raise _PowerCut
        return whole(trainer)

    with monkeypatch.context() as patch, pytest.raises(_PowerCut):
        patch.setattr(Trainer, "update", update)
        training.train(REQUEST, folder, copy_to=copy_to)


def without_times(folder: Path) -> list[dict[str, float]]:
    return [{name: value for name, value in row.items() if name != "seconds"} for row in RunFolder(folder).metrics()]


@pytest.mark.slow
def test_a_run_goes_on_elsewhere_bit_for_bit(
    s3: S3, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, undisturbed: Path
) -> None:
    lost, elsewhere = tmp_path / "lost", tmp_path / "elsewhere"
    cut_off(lost, monkeypatch, updates=4)
    training.train(REQUEST, elsewhere, resume=True, copy_to=ADDRESS)
    ends = [newest_checkpoint(RunFolder(folder).checkpoints) for folder in (undisturbed, elsewhere)]
    assert equal_bits(*map(read_network, ends)) and equal_bits(*map(read_training, ends))
    assert without_times(undisturbed) == without_times(elsewhere)
    again = tmp_path / "again"
    assert RunCopy(ADDRESS).restore(again)  # what is there in the end is the whole run
    assert without_times(again) == without_times(elsewhere)
    kept, copied = ([path.name for path in checkpoints(RunFolder(folder).checkpoints)] for folder in (elsewhere, again))
    assert kept == copied and len(kept) == 2


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs") / "undisturbed"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(training, "SECONDS_BETWEEN_CHECKPOINTS", 0.0)
        training.train(REQUEST, folder)
    return folder


@pytest.fixture(scope="module")
def two_moments(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The run after two updates and, with two checkpoints more, at its end."""
    earlier, later = tmp_path_factory.mktemp("earlier") / "run", tmp_path_factory.mktemp("later") / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(training, "SECONDS_BETWEEN_CHECKPOINTS", 0.0)
        cut_off(earlier, patch, updates=2, copy_to=None)
        shutil.copytree(earlier, later)
        training.train(REQUEST, later, resume=True)
    return earlier, later


@pytest.mark.parametrize(
    "fails_at", [1, 7, *(pytest.param(number, marks=pytest.mark.slow) for number in (2, 4, 5, 8, 9, 10, 12))]
)  # before, within and between what is put and removed
def test_whatever_is_cut_off_leaves_a_whole_copy(
    s3: S3,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    undisturbed: Path,
    two_moments: tuple[Path, Path],
    fails_at: int,
) -> None:
    earlier, later = two_moments
    RunCopy(ADDRESS).update(earlier)
    done, upload, remove = 0, Store.upload, Store.remove

    def counted(*arguments: object) -> None:
        nonlocal done
        done += 1
        if done == fails_at:
            raise _PowerCut
        (upload if len(arguments) == 3 else remove)(*arguments)  # type: ignore[arg-type]

    with monkeypatch.context() as patch, pytest.raises(_PowerCut):
        patch.setattr(Store, "upload", counted)
        patch.setattr(Store, "remove", counted)
        RunCopy(ADDRESS).update(later)
    found = tmp_path / "found"
    assert RunCopy(ADDRESS).restore(found)
    training.train(REQUEST, found, resume=True)
    assert without_times(found) == without_times(undisturbed)


def test_what_was_cut_off_does_not_stay(s3: S3, two_moments: tuple[Path, Path]) -> None:
    """Whatever its name: checkpoints are written when time has passed, and another try has others."""
    earlier, later = two_moments
    kept = [path.name for path in checkpoints(RunFolder(later).checkpoints)]
    for name in ("frames-000000000001", "frames-000000000999", kept[-1], "notes"):
        s3(f"runs/one/checkpoints/{name}/network.safetensors", b"half")
    for folder in (earlier, later):
        RunCopy(ADDRESS).update(folder)
    assert Store(ADDRESS).names(f"{ADDRESS}/checkpoints") == [*kept, "notes"]
    for name in kept:
        assert len(Store(ADDRESS).names(f"{ADDRESS}/checkpoints/{name}")) == 3


@pytest.mark.slow
def test_a_training_goes_on_without_a_store_and_says_so(
    s3: S3, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> None:
        raise ClearwayError("s3://rooms: is full. Make room")

    def full(_: Path) -> None:
        monkeypatch.setattr(Store, "upload", refused)

    warned = pytest.warns(UserWarning, match="not copied: s3://rooms: is full. Make room. The run itself is whole")
    with warned, pytest.raises(ClearwayError, match="is full"):
        training.train(REQUEST, tmp_path / "run", copy_to=ADDRESS, on_begin=full)
    assert newest_checkpoint(RunFolder(tmp_path / "run").checkpoints).name.endswith(f"{FRAMES}")


def test_a_disk_that_is_full_does_not_end_training(s3: S3, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(run_copy, "_snapshot", full)
        with pytest.warns(UserWarning, match="not copied.*No space left"):
            training.train(REQUEST, tmp_path / "run", copy_to=ADDRESS)
    assert newest_checkpoint(RunFolder(tmp_path / "run").checkpoints).name.endswith(f"{FRAMES}")
    assert not list((tmp_path / "run").glob(".copied-*"))


@pytest.mark.slow
def test_training_does_not_wait_for_a_copy(s3: S3, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    upload, update, came_far = Store.upload, Trainer.update, threading.Event()

    def slow(store: Store, path: Path, address: str) -> None:
        if not came_far.wait(20):
            raise ClearwayError("training waits for the copy")
        upload(store, path, address)

    def counted(trainer: Trainer) -> dict[str, float]:
        if trainer.updates == 4:  # by now the checkpoint that is being copied is no longer kept
            came_far.set()
        return update(trainer)

    monkeypatch.setattr(Trainer, "update", counted)

    def begun(folder: Path) -> None:
        monkeypatch.setattr(Store, "upload", slow)

    training.train(REQUEST, tmp_path / "run", copy_to=ADDRESS, on_begin=begun)
    assert RunCopy(ADDRESS).restore(tmp_path / "again")
    assert without_times(tmp_path / "again") == without_times(tmp_path / "run")
    assert not list((tmp_path / "run").glob(".copied-*"))


def test_what_cannot_be_copied_to_is_told_before_a_folder_is_made(s3: S3, tmp_path: Path) -> None:
    out = tmp_path / "run"
    for address in ("https://here/run", "runs/one", "s3:"):
        with pytest.raises(ClearwayError, match="expected an address of s3:// or gs://"):
            training.train(REQUEST, out, copy_to=address)
    with pytest.raises(ClearwayError, match=r"s3://no-such-bucket/run.*: there is nothing there\. Check the address"):
        training.train(REQUEST, out, copy_to="s3://no-such-bucket/run")
    s3("runs/one/run.json", b"{}")
    with pytest.raises(ClearwayError, match=r"holds a run already\. Give --resume"):
        training.train(REQUEST, out, copy_to=ADDRESS)
    assert not out.exists()


@pytest.mark.slow
def test_without_a_copy_resume_begins(s3: S3, tmp_path: Path) -> None:
    training.train(REQUEST, tmp_path / "run", resume=True, copy_to=ADDRESS)
    assert RunCopy(ADDRESS).holds_a_run


@pytest.mark.slow
def test_no_other_run_and_no_further_one_is_copied_over(
    s3: S3, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here, elsewhere = tmp_path / "here", tmp_path / "elsewhere"
    cut_off(here, monkeypatch, updates=2)
    training.train(REQUEST, elsewhere, resume=True, copy_to=ADDRESS)
    with pytest.raises(ClearwayError, match="has come further than"):
        training.train(REQUEST, here, resume=True, copy_to=ADDRESS)
    other = tmp_path / "other"
    training.train(replace(REQUEST, seed=9), other)
    with pytest.raises(ClearwayError, match="holds another experiment than"):
        training.train(replace(REQUEST, seed=9), other, resume=True, copy_to=ADDRESS)
    again = tmp_path / "again"
    assert RunCopy(ADDRESS).restore(again)
    assert RunFolder(again).read_record().seed == REQUEST.seed


def test_a_copy_that_failed_at_the_end_is_made_up(s3: S3, tmp_path: Path) -> None:
    training.train(REQUEST, tmp_path / "run")
    training.train(REQUEST, tmp_path / "run", resume=True, copy_to=ADDRESS)
    assert RunCopy(ADDRESS).restore(tmp_path / "again")
    assert without_times(tmp_path / "again") == without_times(tmp_path / "run")
