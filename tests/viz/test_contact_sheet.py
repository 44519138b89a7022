from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from clearway import colours
from clearway.errors import SceneError
from clearway.viz.contact_sheet import (
    FRAME_PX,
    HEADER_PX,
    MARGIN_PX,
    MOST_VIEWS,
    _caption,
    _shown_steps,
    draw_contact_sheet,
)
from clearway.zones import scene_zones
from helpers.made import corridor_scene

STATES = np.array([0, 4, 8, 9, 9])
ACTIONS = np.array([0, 0, 1, 0])


def test_captions_give_step_action_and_blocked_moves():
    captions = [_caption(step, STATES, ACTIONS) for step in range(5)]
    assert captions == [
        "0 · start",
        "1 · move forward",
        "2 · move forward",
        "3 · turn right",
        "4 · move forward · blocked",
    ]


def test_long_episodes_are_thinned_out_from_first_to_last():
    assert _shown_steps(5) == [0, 1, 2, 3, 4]
    shown = _shown_steps(10_001)
    assert len(shown) == MOST_VIEWS and shown[0] == 0 and shown[-1] == 10_000
    assert max(np.diff(shown)) - min(np.diff(shown)) <= 1


def test_the_sheet_frames_the_target_and_the_zones(tmp_path):
    scene = corridor_scene(5)
    path = tmp_path / "sheet.png"
    draw_contact_sheet(scene, path, states=STATES, actions=ACTIONS, zones=scene_zones(scene), target=16, title="x")
    sheet = Image.open(path).convert("RGB")
    row = HEADER_PX + 20
    first = sheet.getpixel((MARGIN_PX + FRAME_PX // 2, row))
    second = sheet.getpixel((MARGIN_PX + 240 + 2 * FRAME_PX + 16 + FRAME_PX // 2, row))
    assert "#{:02x}{:02x}{:02x}".format(*first) == colours.TARGET
    assert "#{:02x}{:02x}{:02x}".format(*second) == colours.ZONE_COLOURS["collision"]  # backward is blocked at cell 0


def test_a_scene_without_pictures_is_refused(tmp_path):
    scene = replace(corridor_scene(5), observations=None)
    with pytest.raises(SceneError, match="no pictures"):
        draw_contact_sheet(
            scene, tmp_path / "x.png", states=STATES, actions=ACTIONS, zones=scene_zones(scene), target=0
        )
    assert not list(tmp_path.iterdir())
