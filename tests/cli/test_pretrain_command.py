"""`clearway pretrain`: from views to eyes that encode, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import pytest

from clearway.views.settings import ViewSettings
from helpers.made_views import write_made

KEPT = ViewSettings(poses=96, takes=2, sensors=("rgb", "depth"))


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("views")
    write_made(folder, "room", KEPT)
    return folder


@pytest.mark.slow
def test_views_become_an_encoder(clearway, trained, tmp_path, views):
    out = tmp_path / "eyes"
    answer = clearway("pretrain", views, "--out", out, "--pictures", 192, "--threads", 1, "--try-on", views, "--json")
    assert answer.code == 0, answer
    found = answer.json
    assert found["eyes"] == str(out) and found["rooms"] == 1 and 0 <= found["recognised"] <= 1
    assert clearway("pretrain", views, "--out", out, "--pictures", 192, "--threads", 1).refusal(
        "Give --resume to go on"
    )
    assert clearway("pretrain", views, "--out", out, "--pictures", 192, "--threads", 1, "--resume").code == 0
    assert (out / "eyes.safetensors").stat().st_size < 10 * 1024**2


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (("--pictures", 0), ("--pictures 0", "1 to")),
        (("--seed", -1), ("--seed -1",)),
        (("--workers", 13), ("--workers 13", "12 groups of pictures", "Give fewer")),
        (("--device", "nonsense", "--workers", 2, "--ray", "local"), ("nonsense",)),
        (("--ray", "local"), ("--ray 'local'", "several workers", "2 or more")),
        (("--try-on", "nowhere"), ("nowhere",)),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(clearway, tmp_path, views, words, parts):
    assert clearway("pretrain", views, "--out", tmp_path / "eyes", *words).refusal(*parts)
    assert not (tmp_path / "eyes").exists()


def test_views_without_depth_are_refused(clearway, tmp_path):
    write_made(tmp_path, "room", ViewSettings(poses=2, takes=2))
    answer = clearway("pretrain", tmp_path / "room.h5", "--out", tmp_path / "eyes")
    assert answer.refusal("rgb 96 x 128", "Take them with --sensors rgb depth")


def test_views_to_try_eyes_on_are_looked_at_before_any_are_trained(clearway, tmp_path, views):
    write_made(tmp_path, "room", ViewSettings(poses=2, takes=2))
    answer = clearway("pretrain", views, "--out", tmp_path / "eyes", "--try-on", tmp_path / "room.h5")
    assert answer.refusal("--try-on rgb 96 x 128", "Take them with --sensors rgb depth")
    assert not (tmp_path / "eyes").exists()
