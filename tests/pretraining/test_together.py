"""Workers that train eyes together learn what one learns alone, up to rounding."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from torch import Tensor, nn

from clearway.errors import ArgumentError, RunError
from clearway.learn.checkpoint import newest_checkpoint, read_network, read_progress
from clearway.learn.peers import Peers
from clearway.perception.eyes import find_record, from_record, read_card
from clearway.pretraining import trainer as trainer_module
from clearway.pretraining import workers as workers_module
from clearway.pretraining.eyes_folder import EyesFolder
from clearway.pretraining.pretrain import pretrain
from clearway.pretraining.together import own_pictures, share_batch_norms
from clearway.pretraining.trainer import Pretrainer, PretrainRequest
from clearway.pretraining.workers import pretrain_by_workers
from helpers import killed_pretraining
from helpers.by_workers import by_workers
from helpers.crew_processes import wait_until, workers_of
from helpers.killed_pretraining import SETTINGS, made
from helpers.small_runs import equal_bits

UPDATES = 20
ONE_AT_A_TIME = threading.Lock()
SETTINGS_OF_ONE = replace(SETTINGS, pictures=24)


@pytest.fixture
def first(tmp_path: Path) -> PretrainRequest:
    """A pretraining, in whose folder `first` there are eyes of one update."""
    request = PretrainRequest(made(tmp_path / "views"), replace(SETTINGS, pictures=24 * UPDATES), seed=3)
    pretrain(replace(request, settings=SETTINGS_OF_ONE), tmp_path / "first")
    return request


@pytest.fixture
def doubles(first: PretrainRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[PretrainRequest]:
    """Pictures, parameters and whatever is computed from them in float64."""
    torch.set_default_dtype(torch.float64)
    plain = trainer_module.standardised
    monkeypatch.setattr(trainer_module, "standardised", lambda levels: plain(levels).double())
    monkeypatch.setattr(trainer_module, "multiplies_bfloat16", lambda device: False)
    monkeypatch.setattr(torch.Tensor, "float", torch.Tensor.double)
    yield first
    torch.set_default_dtype(torch.float32)


def trained(request: PretrainRequest, peers: Peers) -> tuple[list[dict[str, float]], dict[str, Tensor]]:
    with ONE_AT_A_TIME:  # workers are threads here, which share torch's random numbers
        trainer = Pretrainer(request, peers)
    trainer.eyes.double()
    lessons = trainer.lessons()
    figures = [trainer.update(next(lessons)) for _ in range(UPDATES)]
    lessons.close()
    return figures, {name: tensor.clone() for name, tensor in (trainer.eyes.state_dict() | trainer.tensors()).items()}


@pytest.mark.slow
@pytest.mark.parametrize("kept", [False, True])
def test_workers_together_learn_what_one_learns_alone(tmp_path: Path, doubles: PretrainRequest, kept: bool) -> None:
    """Three groups of pictures by one worker, by two of unequal parts, and by three."""
    request = doubles
    if kept:
        request = replace(request, keeping=from_record(find_record(str(tmp_path / "first"))))
    alone, start = trained(request, Peers()), Pretrainer(request).eyes.state_dict()
    moved = "pose.0.weight" if kept else "trunk.0.0.weight"
    assert not torch.allclose(start[moved], alone[1][moved], atol=1e-5)
    for workers in (2, 3):
        for figures, tensors in by_workers(workers, lambda peers: trained(request, peers)):
            for one, together in zip(alone[0], figures, strict=True):
                assert one == pytest.approx(together, abs=1e-9, rel=1e-9)
            assert tensors.keys() == alone[1].keys()
            for name, tensor in alone[1].items():
                torch.testing.assert_close(
                    tensors[name], tensor, rtol=1e-9, atol=1e-9, msg=lambda m, n=name: f"{n}: {m}"
                )


def test_batches_are_divided_by_whole_groups() -> None:
    parts = [own_pictures(SETTINGS, peers) for peers in map(at, range(3))]
    assert parts == [slice(0, 8), slice(8, 16), slice(16, 24)]
    with pytest.raises(ArgumentError, match=r"workers=4: a batch has 3 groups of pictures, one a worker\. Give fewer"):
        own_pictures(SETTINGS, at(0, 4))


def at(rank: int, count: int = 3) -> Peers:
    peers = Peers()
    peers.rank, peers.count = rank, count
    return peers


def test_a_shared_batch_norm_that_does_not_train_goes_by_what_it_has_seen() -> None:
    network, x = nn.Sequential(nn.BatchNorm2d(3)), torch.randn(4, 3, 5, 5)
    network(x)
    network.eval()
    expected = network(x)
    share_batch_norms(network, at(0), 4)
    assert torch.equal(network(x), expected)


def test_a_pretraining_that_does_not_begin_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def lost(*_: object) -> None:
        raise RunError("no room")

    monkeypatch.setattr(workers_module, "launched_by", lost)
    request = PretrainRequest(made(tmp_path / "views"), SETTINGS)
    (tmp_path / "there").mkdir()
    (tmp_path / "there/notes.txt").touch()
    for name in ("new", "there"):
        with pytest.raises(RunError, match="no room"):
            pretrain_by_workers(request, tmp_path / name, 2, threads=1)
    assert not (tmp_path / "new").exists()
    assert [path.name for path in (tmp_path / "there").iterdir() if path.name != ".lock"] == ["notes.txt"]


def test_more_workers_than_groups_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    request = PretrainRequest(made(tmp_path / "views"), SETTINGS)
    with pytest.raises(ArgumentError, match="workers=4: a batch has 3 groups"):
        pretrain_by_workers(request, tmp_path / "eyes", 4)
    assert not (tmp_path / "eyes").exists()


def started(folder: Path) -> subprocess.Popen[str]:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", "helpers.killed_pretraining", str(folder)]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="finds the workers in /proc")
def test_a_worker_that_is_killed_is_replaced_and_nothing_is_learnt_twice(tmp_path: Path) -> None:
    for name in ("whole", "killed"):
        process = started(tmp_path / name)
        if name == "killed":
            folder = EyesFolder(tmp_path / name / "eyes")
            wait_until(lambda folder=folder: any(folder.checkpoints.glob("frames-*")), process)
            os.kill(workers_of(process.pid)[-1], signal.SIGKILL)
        _, errors = process.communicate(timeout=120)
        assert process.returncode == 0, errors
    assert "go on from the newest checkpoint" in errors
    whole, killed = (EyesFolder(tmp_path / name / "eyes") for name in ("whole", "killed"))
    ends = [newest_checkpoint(folder.checkpoints) for folder in (whole, killed)]
    assert [read_progress(end).updates for end in ends] == [killed_pretraining.UPDATES] * 2
    assert equal_bits(*[read_network(end) for end in ends])
    rows = [[row | {"seconds": 0} for row in folder.metrics()] for folder in (whole, killed)]
    assert rows[0] == rows[1]
    assert read_card(killed.path).trained["hardware"]["workers"] == killed_pretraining.WORKERS
