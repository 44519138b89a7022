"""Eyes that a GPU trains: run with -m gpu where there is one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from clearway.perception.eyes import find_record, from_record, read_card
from clearway.perception.eyes_network import EyesShape
from clearway.pretraining import trainer as trainer_module
from clearway.pretraining.augment import NOISE, chances, relit
from clearway.pretraining.pretrain import pretrain
from clearway.pretraining.settings import PretrainSettings
from clearway.pretraining.trainer import Pretrainer, PretrainRequest
from clearway.views.settings import ViewSettings
from clearway.views.stream import Views, views_in
from helpers.made_views import write_made

pytestmark = [
    pytest.mark.gpu,
    pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU that torch can use"),
]
SHAPE = EyesShape((8, 8, 8), token_width=4, description_width=4, hidden_width=8, height_px=32, width_px=32)
SETTINGS = PretrainSettings(pictures=96, batch=16, together=4, partners=2, shape=SHAPE)


@pytest.fixture
def views(tmp_path: Path) -> Views:
    (tmp_path / "views").mkdir()
    for room in range(3):
        kept = ViewSettings(poses=10, takes=2, sensors=("rgb", "depth"), size_px=(32, 32))
        write_made(tmp_path / "views", f"room{room}", kept, seed=room)
    return views_in([tmp_path / "views"])


def test_it_learns_what_the_processor_learns(views: Views, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trainer_module, "multiplies_bfloat16", lambda device: False)
    monkeypatch.setattr(torch.backends.cudnn, "allow_tf32", False)
    trainers = [Pretrainer(PretrainRequest(views, SETTINGS, seed=3, device=device)) for device in ("cpu", "cuda")]
    lessons = trainers[0].lessons()  # a GPU draws other noise of pictures
    same = [next(lessons) for _ in range(4)]
    lessons.close()
    told = [[trainer.update(lesson) for lesson in same] for trainer in trainers]
    for here, there in zip(*told, strict=True):
        assert here == pytest.approx(there, rel=1e-3)


def test_pictures_are_relit_where_they_are(views: Views) -> None:
    request = PretrainRequest(views, SETTINGS, seed=3, device="cuda")
    first, again = (next(Pretrainer(request).lessons()).pixels for _ in range(2))
    assert first.is_cuda and torch.equal(first, again)
    plain = next(Pretrainer(replace(request, device="cpu")).lessons()).pixels
    assert first.shape == plain.shape and first.stride() == plain.stride() and first.dtype == plain.dtype
    grey = torch.full((64, 24, 32, 3), 100, dtype=torch.uint8, device="cuda")
    levels = relit(grey, chances([3, 5], grey.device))
    light, noise = levels.mean((1, 2, 3)) / 100, levels.std((1, 2)).mean(1)
    assert 0.55 < light.min() < 0.85 and 1.15 < light.max() < 1.45 and NOISE / 2 < noise.max() < NOISE + 2


def test_a_training_goes_on_on_the_gpu_and_the_processor_sees_with_the_eyes(tmp_path: Path, views: Views) -> None:
    request = PretrainRequest(views, SETTINGS, seed=3, device="cuda")

    def interrupt(count: int) -> None:
        if count == 48:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pretrain(request, tmp_path / "eyes", done=interrupt)
    pretrain(request, tmp_path / "eyes", resume=True)
    assert read_card(tmp_path / "eyes").trained["hardware"]["gpu"] == torch.cuda.get_device_name()
    eyes = from_record(find_record(str(tmp_path / "eyes")))
    assert np.isfinite(eyes.encode(views.shards[0].seen("rgb", slice(0, 8)))).all()
    second = replace(request, keeping=eyes, seed=4)
    pretrain(second, tmp_path / "second")
    kept = from_record(find_record(str(tmp_path / "second")))
    pictures = views.shards[0].seen("rgb", slice(0, 8))
    np.testing.assert_array_equal(kept.encode(pictures), eyes.encode(pictures))
