"""A pretraining by two workers, with a checkpoint after every update: `python -m helpers.killed_pretraining FOLDER`."""

from __future__ import annotations

import sys
from pathlib import Path

from clearway.perception.eyes_network import EyesShape
from clearway.pretraining.settings import PretrainSettings
from clearway.pretraining.trainer import PretrainRequest
from clearway.pretraining.workers import pretrain_by_workers
from clearway.views.settings import ViewSettings
from clearway.views.stream import Views, views_in
from helpers.made_views import write_made

UPDATES = 60
WORKERS = 2
SHAPE = EyesShape((8, 8, 8), token_width=4, description_width=4, hidden_width=8, height_px=32, width_px=32)
SETTINGS = PretrainSettings(pictures=24 * UPDATES, batch=24, together=4, partners=2, shape=SHAPE)
KEPT = ViewSettings(poses=12, takes=2, sensors=("rgb", "depth"), size_px=(32, 32))


def made(folder: Path) -> Views:
    """Views of three rooms."""
    folder.mkdir(parents=True)
    for room in range(3):
        write_made(folder, f"room{room}", KEPT, seed=room)
    return views_in([folder])


if __name__ == "__main__":
    where = Path(sys.argv[1])
    request = PretrainRequest(made(where / "views"), SETTINGS)
    pretrain_by_workers(request, where / "eyes", WORKERS, threads=1, checkpoint_s=0.0)
