from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.live.live_room import live_room
from clearway.scenes.scene import Provenance
from helpers.made import corridor_scene


def test_a_scene_that_is_no_room_of_ours_is_refused():
    scene = replace(corridor_scene(), made_by=Provenance("thor_v1"))
    with pytest.raises(SceneError, match=r"corridor: .*comes from thor_v1.*scenes build"):
        live_room(scene)


def test_a_room_that_is_built_differently_now_is_refused():
    scene = replace(corridor_scene(), made_by=Provenance("room", room="bathroom", seed=0))
    with pytest.raises(SceneError, match=r"another grid.*Build the scene again"):
        live_room(scene)


def test_the_camera_sees_the_new_obstacle_only_where_a_layout_puts_it(live):
    names = [live.model.body(body).name for body in range(live.model.nbody) if live.model.body_mocapid[body] >= 0]
    assert names[-1] == "new obstacle" and len(names) == 3
    body = live.model.body("new obstacle")
    np.testing.assert_array_equal(body.pos, [0, 0, -10])
