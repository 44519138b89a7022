"""Trackers, by stand-ins for their packages and, where they are installed, by themselves."""

import importlib.util
import json
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from clearway.errors import RunError
from clearway.learn.metrics_log import MetricsLog
from clearway.learn.run_folder import RunFolder
from clearway.learn.tracking import check_tracker, tracker_of
from clearway.learn.train import RunRequest, train
from clearway.reward import COLLISION_AWARE
from helpers.small_runs import small_learner, small_scenes, small_targets

ROWS = [{"frames": 80 * number, "seconds": float(number), "loss": 0.5 / number} for number in range(1, 5)]


def installed(monkeypatch: pytest.MonkeyPatch, *names: str) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: name if name in names else None)


@pytest.mark.parametrize("name", ["tensorboard", "wandb"])
def test_a_package_that_is_missing_is_named_with_its_extra(tmp_path, monkeypatch, name):
    installed(monkeypatch)
    request = RunRequest(small_scenes(), small_targets(), small_learner(), COLLISION_AWARE)
    with pytest.raises(RunError, match=rf"needs {name}\. Install it: .* -m pip install '/.*\[{name}\]'"):
        train(request, tmp_path / "run", track=name)
    assert not (tmp_path / "run").exists()


def test_an_unknown_tracker_is_refused_and_none_is_none(tmp_path):
    with pytest.raises(RunError, match="expected tensorboard or wandb"):
        check_tracker("mlflow")
    assert tracker_of(None, tmp_path, {}) is None
    assert not list(tmp_path.iterdir())


class FakeWriter:
    """Stands in for TensorBoard's: appends what it is handed to a file in its folder."""

    def __init__(self, log_dir: str, purge_step: int | None) -> None:
        folder = Path(log_dir)
        folder.mkdir(exist_ok=True)
        self.file = (folder / "events").open("a")

    def add_scalar(self, name: str, value: float, step: float, walltime: float) -> None:
        self.file.write(json.dumps([name, step, value, walltime]) + "\n")

    def close(self) -> None:
        self.file.close()


@pytest.fixture
def fake_board(monkeypatch: pytest.MonkeyPatch) -> None:
    installed(monkeypatch, "tensorboard")
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", SimpleNamespace(SummaryWriter=FakeWriter))


def tracked(name: Any, folder: Path, before: list, after: list, seconds: float = 0.0) -> None:
    log = MetricsLog(folder / "metrics.jsonl", tracker_of(name, folder, {"seed": 3}, before, seconds))
    for row in after:
        log.write(row)
    log.close()


@pytest.mark.usefixtures("fake_board")
def test_tensorboard_has_each_figure_of_a_resumed_run_once(tmp_path: Path) -> None:
    tracked("tensorboard", tmp_path, [], ROWS[:3])
    path = tmp_path / "metrics.jsonl"
    path.write_text(json.dumps(ROWS[0]) + "\n")  # the checkpoint was written after the first row
    tracked("tensorboard", tmp_path, ROWS[:1], ROWS[1:], seconds=1.5)
    events = [json.loads(line) for line in (tmp_path / "tensorboard" / "events").read_text().splitlines()]
    assert [event[:3] for event in events] == [[name, r["frames"], r[name]] for r in ROWS for name in r]
    times = [event[3] for event in events if event[0] == "loss"]
    assert [later - times[0] for later in times] == pytest.approx([0.0, 1.0, 2.0, 3.0], abs=1e-3)
    assert [json.loads(line) for line in path.read_text().splitlines()] == ROWS


@pytest.mark.slow
@pytest.mark.usefixtures("fake_board")
def test_a_run_is_tracked_where_it_is_asked_for_alone(tmp_path: Path) -> None:
    request = RunRequest(small_scenes(), small_targets(), small_learner(), COLLISION_AWARE)
    train(request, tmp_path / "plain")
    assert not (tmp_path / "plain" / "tensorboard").exists()
    train(request, tmp_path / "run", track="tensorboard")
    events = [json.loads(line) for line in (tmp_path / "run" / "tensorboard" / "events").read_text().splitlines()]
    rows = RunFolder(tmp_path / "run").metrics()
    assert [event[:3] for event in events] == [[name, r["frames"], r[name]] for r in rows for name in r]


class FakeWandb:
    """Stands in for Weights & Biases."""

    Error = type("Error", (Exception,), {})

    def __init__(self, logged_in: bool) -> None:
        self.logged_in, self.begun, self.rows, self.finished = logged_in, [], [], 0
        self.Settings = dict

    def login(self, *, prompt: bool, verify: bool) -> bool:
        assert not prompt
        return self.logged_in

    def init(self, **given: Any) -> "FakeWandb":
        self.begun.append(given)
        return self

    def log(self, row: dict[str, float], step: int) -> None:
        self.rows.append((step, row))

    def finish(self) -> None:
        self.finished += 1


def fake_wandb(monkeypatch: pytest.MonkeyPatch, logged_in: bool = False) -> FakeWandb:
    fake = FakeWandb(logged_in)
    installed(monkeypatch, "wandb")
    monkeypatch.setitem(sys.modules, "wandb", fake)
    monkeypatch.delenv("WANDB_MODE", raising=False)
    monkeypatch.delenv("WANDB_PROJECT", raising=False)
    return fake


def test_wandb_is_offline_and_has_one_run_for_a_folder(tmp_path, monkeypatch):
    fake = fake_wandb(monkeypatch)
    folder = tmp_path / "bathroom-ppo"
    folder.mkdir()
    tracked("wandb", folder, [], ROWS[:2])
    tracked("wandb", folder, ROWS[:2], ROWS[2:])
    first, second = fake.begun
    assert (first["mode"], first["name"], first["project"]) == ("offline", "bathroom-ppo", "clearway")
    assert (first["config"], first["dir"], first["id"]) == ({"seed": 3}, str(folder), second["id"])
    assert fake.rows == [(row["frames"], row) for row in ROWS]
    assert fake.finished == 2


def test_wandb_gets_the_rows_of_a_run_that_was_not_tracked_before(tmp_path, monkeypatch):
    fake = fake_wandb(monkeypatch)
    tracked("wandb", tmp_path, ROWS[:2], ROWS[2:])
    assert fake.rows == [(row["frames"], row) for row in ROWS]


def test_wandb_is_online_for_who_is_logged_in_and_as_its_variable_says(tmp_path, monkeypatch):
    fake = fake_wandb(monkeypatch, logged_in=True)
    tracked("wandb", tmp_path, [], ROWS[:1])
    monkeypatch.setenv("WANDB_MODE", "offline")
    tracked("wandb", tmp_path, ROWS[:1], [])
    assert [(begun["mode"], begun["resume"]) for begun in fake.begun] == [("online", "allow"), ("offline", None)]


def test_what_wandb_refuses_is_one_line(tmp_path, monkeypatch):
    fake = fake_wandb(monkeypatch)

    def init(**given: Any) -> None:
        raise fake.Error("no\nway")

    monkeypatch.setattr(fake, "init", init)
    with pytest.raises(RunError, match=r"--track wandb: no way\. Log in"):
        tracked("wandb", tmp_path, [], ROWS)


def test_tensorboard_reads_what_was_written(tmp_path: Path) -> None:
    pytest.importorskip("tensorboard")
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    tracked("tensorboard", tmp_path, [], ROWS[:2])
    tracked("tensorboard", tmp_path, ROWS[:1], [ROWS[1] | {"loss": 7.0}], seconds=1.0)
    read = EventAccumulator(str(tmp_path / "tensorboard")).Reload()
    assert set(read.Tags()["scalars"]) == set(ROWS[0])
    assert [(event.step, event.value) for event in read.Scalars("loss")] == [(80, 0.5), (160, 7.0)]


@pytest.mark.filterwarnings("default")
def test_wandb_itself_writes_offline(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("wandb")
    monkeypatch.setenv("WANDB_MODE", "offline")
    tracked("wandb", tmp_path, [], ROWS[:2])
    tracked("wandb", tmp_path, ROWS[:2], ROWS[2:])
    files = list((tmp_path / "wandb").glob("offline-run-*/run-*.wandb"))
    assert files
    assert all(b"loss" in path.read_bytes() for path in files)
