from __future__ import annotations

import importlib.util
import os
import signal
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from safetensors.torch import load_file

from clearway.api.pretraining import pretrain as pretrained
from clearway.errors import ArgumentError, ClearwayError, RunError
from clearway.learn.checkpoint import newest_checkpoint, read_training
from clearway.perception.encode import find_record
from clearway.perception.eyes import find_record as find_eyes
from clearway.perception.eyes import from_record, read_card, read_eyes
from clearway.perception.eyes_network import EyesShape
from clearway.pretraining.judge import judge, recognition
from clearway.pretraining.losses import drawn_pairs
from clearway.pretraining.pretrain import pretrain
from clearway.pretraining.settings import PretrainSettings
from clearway.pretraining.trainer import Pretrainer, PretrainRequest
from clearway.views.settings import ViewSettings
from clearway.views.stream import Views, views_in
from helpers.made_views import write_made

SHAPE = EyesShape((8, 8, 8), token_width=4, description_width=4, hidden_width=8, height_px=32, width_px=32)
SETTINGS = PretrainSettings(pictures=96, batch=16, together=4, partners=2, shape=SHAPE)
KEPT = ViewSettings(poses=10, takes=2, sensors=("rgb", "depth"), size_px=(32, 32))


def made(folder: Path, rooms: int = 3, kept: ViewSettings = KEPT) -> Views:
    folder.mkdir()
    for room in range(rooms):
        write_made(folder, f"room{room}", kept, seed=room)
    return views_in([folder])


@pytest.fixture
def views(tmp_path: Path) -> Views:
    return made(tmp_path / "views")


@pytest.fixture(autouse=True)
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def interrupt_after(pictures: int):
    def done(count: int) -> None:
        if count == pictures:
            os.kill(os.getpid(), signal.SIGINT)

    return done


def test_a_training_that_was_interrupted_goes_on_bit_for_bit(tmp_path: Path, views: Views):
    request = PretrainRequest(views, SETTINGS, seed=3)
    pretrain(request, tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        pretrain(request, tmp_path / "parts", done=interrupt_after(48))
    assert not (tmp_path / "parts" / "eyes.json").exists()
    pretrain(request, tmp_path / "parts", resume=True)
    whole, parts = (load_file(tmp_path / name / "eyes.safetensors") for name in ("whole", "parts"))
    assert whole.keys() == parts.keys() and all(torch.equal(whole[name], parts[name]) for name in whole)
    whole, parts = (read_training(newest_checkpoint(tmp_path / name / "checkpoints")) for name in ("whole", "parts"))
    assert all(torch.equal(whole[name], parts[name]) for name in whole)
    rows = [(tmp_path / name / "metrics.jsonl").read_text().splitlines() for name in ("whole", "parts")]
    assert len(rows[0]) == len(rows[1]) == 6


def test_the_folder_is_an_encoder_that_says_how_it_was_trained(tmp_path: Path, views: Views):
    pretrain(PretrainRequest(views, SETTINGS), tmp_path / "eyes")
    assert find_record(str(tmp_path / "eyes"), []).name == "eyes"
    trained = read_card(tmp_path / "eyes").trained
    assert trained["pictures"] == 96 and trained["seed"] == 0
    assert trained["views"]["rooms"] == 3 and trained["views"]["pictures"] == 60


def test_one_file_of_views_need_not_stand_in_a_list(tmp_path: Path):
    for name in ("views", "try_on"):
        given = {"views": str(tmp_path / "none"), name: str(tmp_path / "none")}
        with pytest.raises(ClearwayError, match="none: no such"):
            pretrained(out=tmp_path / "eyes", **given)


def test_another_seed_gives_other_eyes(views: Views):
    one, again, other = (Pretrainer(PretrainRequest(views, SETTINGS, seed)) for seed in (1, 1, 2))
    figures = [trainer.update(next(trainer.lessons()))["loss"] for trainer in (one, again, other)]
    assert figures[0] == figures[1] != figures[2]


def test_eyes_learn(tmp_path: Path):
    views = made(tmp_path / "views", rooms=2)
    trainer = Pretrainer(PretrainRequest(views, replace(SETTINGS, pictures=16 * 120, learning_rate=1e-2)))
    lessons = trainer.lessons()
    rows = [trainer.update(next(lessons)) for _ in range(120)]
    for part in ("loss_stands", "loss_match"):
        early, late = (np.mean([row[part] for row in some]) for some in (rows[:10], rows[-10:]))
        assert late < 0.9 * early, part


def test_features_stay_as_they_are_where_they_are_kept(tmp_path: Path, views: Views):
    pretrain(PretrainRequest(views, SETTINGS), tmp_path / "first")
    before = from_record(find_eyes(str(tmp_path / "first")))
    pretrain(PretrainRequest(views, SETTINGS, 1, before), tmp_path / "second")
    after = from_record(find_eyes(str(tmp_path / "second")))
    pictures = views.shards[0].seen("rgb", slice(0, 8))
    np.testing.assert_array_equal(after.encode(pictures), before.encode(pictures))
    one, other = (encoder.eyes.state_dict() for encoder in (before, after))
    changed = {name.split(".")[0] for name in one if not torch.equal(one[name], other[name])}
    assert {"pose", "told"} <= changed and not {"trunk", "description"} & changed
    assert other["stood"][-1] == 1 + SETTINGS.pictures, "counted anew"
    assert read_card(tmp_path / "second").trained["keeping"]["sha256"] == read_card(tmp_path / "first").sha256


def test_a_training_that_keeps_features_goes_on_bit_for_bit(tmp_path: Path, views: Views):
    pretrain(PretrainRequest(views, SETTINGS), tmp_path / "first")
    request = PretrainRequest(views, SETTINGS, 1, from_record(find_eyes(str(tmp_path / "first"))))
    pretrain(request, tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        pretrain(request, tmp_path / "parts", done=interrupt_after(48))
    with pytest.raises(RunError, match="with other keeping"):
        pretrain(replace(request, keeping=None), tmp_path / "parts", resume=True)
    pretrain(request, tmp_path / "parts", resume=True)
    whole, parts = (load_file(tmp_path / name / "eyes.safetensors") for name in ("whole", "parts"))
    assert all(torch.equal(whole[name], parts[name]) for name in whole)


def test_another_training_in_the_folder_is_refused(tmp_path: Path, views: Views):
    out = tmp_path / "eyes"
    pretrain(PretrainRequest(views, SETTINGS), out)
    with pytest.raises(RunError, match=r"holds a pretraining already\. Give --resume"):
        pretrain(PretrainRequest(views, SETTINGS), out)
    with pytest.raises(RunError, match="with other settings and seed"):
        pretrain(PretrainRequest(views, replace(SETTINGS, pictures=32), seed=1), out, resume=True)
    other = made(tmp_path / "others", rooms=2)
    with pytest.raises(RunError, match="with other views"):
        pretrain(PretrainRequest(other, SETTINGS), out, resume=True)


def test_views_of_another_kind_are_refused(tmp_path: Path, views: Views):
    with pytest.raises(ArgumentError, match="rgb 32 x 32, depth 32 x 32: expected rgb and depth of 96 x 128"):
        PretrainRequest(views, replace(SETTINGS, shape=EyesShape()))
    colour = made(tmp_path / "colour", kept=replace(KEPT, sensors=("rgb",)))
    with pytest.raises(ArgumentError, match="--sensors rgb depth"):
        PretrainRequest(colour, SETTINGS)
    thrice = made(tmp_path / "thrice", kept=replace(KEPT, takes=3))
    with pytest.raises(ArgumentError, match="--takes 2"):
        PretrainRequest(thrice, SETTINGS)
    with pytest.raises(ArgumentError, match="fewer than one batch of 160"):
        PretrainRequest(views, replace(SETTINGS, batch=160))


def test_partners_are_of_the_same_group():
    first, second = drawn_pairs(32, 3, 8, np.random.default_rng(0))
    assert first.tolist() == np.repeat(np.arange(32), 3).tolist()
    np.testing.assert_array_equal(first // 8, second // 8)
    assert len(np.unique(second % 8)) == 8


def test_recognition_counts_the_nearest_of_the_first_takes():
    kept = np.eye(4)[:3]
    seen = np.array([[0.9, 0.1, 0, 0], [0.1, 0, 0.9, 0], [0.9, 0, 0, 0.1]])  # right; the third's; the first's
    features = np.stack([kept, seen], axis=1).reshape(6, 4)
    poses = np.repeat([[0, 0, 0], [0.2, 0, 340], [0, 0.4, 5]], 2, axis=0)
    found = recognition(torch.from_numpy(features), poses)
    assert found == {"recognised": pytest.approx(1 / 3), "recognised_near": 1.0}
    poses[4:, 1] = 0.6  # the third one is farther than a step from both others
    assert recognition(torch.from_numpy(features), poses)["recognised_near"] == pytest.approx(1 / 3)


def test_eyes_are_judged_room_by_room(tmp_path: Path, views: Views):
    pretrain(PretrainRequest(views, SETTINGS), tmp_path / "eyes")
    eyes = read_eyes(tmp_path / "eyes")
    found, again = (judge(eyes, views, seed=1) for _ in range(2))
    assert found == again and found.rooms == 3 and not eyes.training
    assert 0 <= found.recognised <= found.recognised_near <= 1 and 0 <= found.overlap <= 1


def test_a_training_is_shown_where_it_is_asked_for(tmp_path: Path, views: Views, monkeypatch: pytest.MonkeyPatch):
    begun = []

    class Board:
        def __init__(self, folder: str, purge_step: int | None) -> None:
            begun.append((folder, []))

        def add_scalar(self, name: str, value: float, step: float, walltime: float) -> None:
            begun[-1][1].append((name, value, step))

        def close(self) -> None:
            pass

    monkeypatch.setattr(importlib.util, "find_spec", lambda name: name if name == "tensorboard" else None)
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", SimpleNamespace(SummaryWriter=Board))
    folder = pretrain(PretrainRequest(views, SETTINGS), tmp_path / "eyes", track="tensorboard")
    ((where, shown),) = begun
    assert where == str(tmp_path / "eyes" / "tensorboard")
    assert shown == [(name, row[name], row["frames"]) for row in folder.metrics() for name in row]
    with pytest.raises(RunError, match="needs wandb"):
        pretrain(PretrainRequest(views, SETTINGS), tmp_path / "other", track="wandb")
    assert len(begun) == 1 and not (tmp_path / "other").exists()
