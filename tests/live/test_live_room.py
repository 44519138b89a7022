from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.generation.files import notes_of
from clearway.generation.plans import generated_plan
from clearway.generation.request import Request
from clearway.live.around import RoomAround
from clearway.live.body import Body
from clearway.live.live_room import live_room, live_room_named
from clearway.rooms.build import build_floor_plan
from clearway.rooms.camera import first_person_view
from clearway.rooms.render import render
from clearway.scenes.actions import BLOCKED, Action
from clearway.scenes.floor_plans import FloorPlan
from clearway.scenes.plan_scenes import floor_plan_scene
from clearway.scenes.scene import Provenance
from helpers.made import corridor_scene
from helpers.plan_maps import plan_of


def test_a_scene_that_is_no_room_of_ours_is_refused():
    scene = replace(corridor_scene(), made_by=Provenance("thor_v1"))
    with pytest.raises(SceneError, match=r"corridor: .*comes from thor_v1.*It cannot be seen anew"):
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


@pytest.mark.slow
def test_a_floor_plan_is_a_room_to_walk_in_whose_moves_are_those_of_the_plan():
    reachable = np.ones((4, 3), bool)
    reachable[1, 1] = False
    scene = floor_plan_scene(FloorPlan.of_map("ring", reachable, np.array([[[2, 0], [3, 0]]])), feature_count=4)
    live = live_room(scene)
    body = Body(RoomAround(live.room, live.agent))
    np.testing.assert_allclose(live.scene.locations_m + live.origin_m, scene.locations_m)
    for state in range(scene.state_count):
        x_m, z_m, heading_deg = live.pose_of(state)
        for action, sign in ((Action.MOVE_FORWARD, 1), (Action.MOVE_BACKWARD, -1)):
            body.stand_at(np.array([x_m, z_m]))
            step = body.move(sign * scene.cell_size_m, heading_deg)
            assert step.contact == (scene.graph[state, action] == BLOCKED), (state, action)


@pytest.mark.slow
def test_a_generated_room_is_one_to_walk_in_and_another_plan_is_not_taken_for_it():
    request = Request("room", "test", 0, 0)
    plan = generated_plan(request)
    made_by = Provenance("generated", seed=0, notes=notes_of(request))
    scene = replace(floor_plan_scene(plan, feature_count=4), made_by=made_by)
    live = live_room(scene)
    assert live.model.nmocap == len(live.as_built().bodies_m) > 3  # a body for each piece, and the new obstacle's
    body = Body(RoomAround(live.room, live.agent))
    for state in range(0, scene.state_count, 7):
        x_m, z_m, heading_deg = live.pose_of(state)
        body.stand_at(np.array([x_m, z_m]))
        blocked = scene.graph[state, Action.MOVE_FORWARD] == BLOCKED
        assert body.move(scene.cell_size_m, heading_deg).contact == blocked, state
    moves = scene.graph.copy()
    moves[0, Action.MOVE_FORWARD] = BLOCKED if moves[0, Action.MOVE_FORWARD] != BLOCKED else 0
    with pytest.raises(SceneError, match="are not those of a floor plan"):
        live_room(replace(scene, graph=moves))


def test_a_room_of_another_version_of_the_generator_is_refused():
    request = Request("room", "test", 0, 0)
    notes = {**notes_of(request), "generator": 99}
    scene = replace(floor_plan_scene(generated_plan(request), feature_count=4))
    with pytest.raises(SceneError, match="was made by version 99 of the generator, this clearway has version"):
        live_room(replace(scene, made_by=Provenance("generated", seed=0, notes=notes)))


@pytest.mark.slow
def test_the_camera_sees_the_room_in_the_detail_of_the_scene():
    scene = build_floor_plan(plan_of("nook", ("..#", "#..")), 1, size_px=(30, 40), workers=1)
    assert scene.made_by.notes["detail"] == "small"
    live = live_room(scene)
    view = first_person_view(live.scene.locations_m, scene.headings_deg, height_px=30, width_px=40, fast=True)
    seen = render(live.model, view, workers=1)
    assert np.abs(seen.astype(int) - scene.observations).mean() < 0.1
    unrecorded = live_room(replace(scene, made_by=replace(scene.made_by, notes={})))
    assert unrecorded.model.mesh_facenum.sum() > 1.4 * live.model.mesh_facenum.sum()


@pytest.mark.slow
def test_a_room_by_its_name_is_that_of_its_scene():
    named = live_room_named("bathroom", 1)
    assert named.scene.name == "bathroom-1"
    again = live_room(named.scene)
    assert again.model.nbody == named.model.nbody > 2
    np.testing.assert_array_equal(again.model.geom_pos, named.model.geom_pos)
