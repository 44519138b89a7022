"""What the demo's page opens with: the shipped agents side by side, moving."""

from pathlib import Path

from PIL import Image, ImageSequence

from clearway.examples.contrast import FILE, SHOWN_PX, contrast


def test_the_example_s_episode_moves_and_its_caption_has_the_contrast(tmp_path: Path) -> None:
    picture = contrast(tmp_path)
    assert picture.file == FILE
    with Image.open(tmp_path / FILE) as film:
        waits = [frame.copy().info["duration"] for frame in ImageSequence.Iterator(film)]  # known once it is read
        assert film.width == SHOWN_PX and film.info["loop"] == 0
    assert len(waits) == 18 and waits[-1] > waits[0]  # the start and 17 steps; it waits at the end
    assert (tmp_path / FILE).stat().st_size < 2_000_000
    assert "shortest bumped 1 time, collision-aware bumped 0 times" in picture.caption
    assert "shortest 0.116 (0.082 to 0.156), collision-aware 0.040 (0.020 to 0.062)" in picture.caption
