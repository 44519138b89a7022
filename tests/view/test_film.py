"""Frames of several walkers, one above the other."""

import numpy as np
from PIL import Image

from clearway import colours
from clearway.view.film import NAME_PX, stacked


def test_walkers_whose_pictures_have_other_shapes_stand_above_each_other() -> None:
    narrow, wide = np.zeros((4, 6, 3), np.uint8), np.full((2, 40, 3), 9, np.uint8)
    found = list(stacked([iter([narrow, narrow]), iter([wide])], ["narrow", "wide"]))
    assert [frame.shape for frame in found] == [(2 * NAME_PX + 6, 40, 3)] * 2
    rows = found[1][NAME_PX : NAME_PX + 4]
    assert (rows[:, :6] == 0).all() and (rows[:, 6:] == Image.new("RGB", (1, 1), colours.PAPER).getpixel((0, 0))).all()
    assert (found[1][-2:] == 9).all()
