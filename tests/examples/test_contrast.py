"""What the demo's page opens with: the shipped agents side by side, moving."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageColor, ImageSequence

from clearway.examples.contrast import FILE, contrast
from clearway.viz.figures import BY_REWARD


@pytest.mark.slow
def test_the_example_s_episode_moves_under_the_contrast(tmp_path: Path) -> None:
    opening = contrast(tmp_path)
    lengths = []
    for picture, name in zip(opening.pictures, ("shortest", "collision-aware"), strict=True):
        assert picture.file == FILE.format(name)
        with Image.open(tmp_path / picture.file) as film:
            waits, last = [], None
            for frame in ImageSequence.Iterator(film):
                last = np.asarray(frame.convert("RGB")).astype(int)
                waits.append(frame.info["duration"])  # known once it is read
            assert film.info["loop"] == 0
        lengths.append(sum(waits))
        assert len(waits) > 14 and waits[-1] > waits[0]  # it waits at the end
        assert (tmp_path / picture.file).stat().st_size < 1_000_000
        assert last is not None
        near = np.abs(last - ImageColor.getrgb(BY_REWARD[name].colour)).max(axis=2) < 25
        assert near.mean() > 0.003  # its way has its colour
    assert lengths[0] == lengths[1]  # both play in step
    assert [picture.caption for picture in opening.pictures] == [
        "shortest: 17 steps, 1 collision",
        "collision-aware: 14 steps, 0 collisions",
    ]
    told = [(figure.value, figure.note) for figure in opening.figures]
    assert told == [("0.116", "95 %: 0.082 to 0.156"), ("0.040", "95 %: 0.020 to 0.062")]
    assert "start was chosen" in opening.text
