"""Poses are free, keep to their cells, follow from the seed, and are measured as the body measures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.live.conditions import Perturbations
from clearway.live.live_room import LiveRoom
from clearway.live.words import GEOMETRY
from clearway.perception.around import PLACES_M
from clearway.rooms.camera import first_person_shot
from clearway.views import placing, poses
from clearway.views.poses import REACH_M, Taken, draw_takes
from clearway.views.settings import ViewSettings
from clearway.zones import Zone

STILL = ViewSettings(poses=40, takes=1, perturbations=Perturbations())
MOVING = ViewSettings(poses=15, takes=2, perturbations=GEOMETRY)
RADIUS_M = 0.2


def drawn(live: LiveRoom, settings: ViewSettings) -> Taken:
    return draw_takes(live, live.scene.held_out, settings)


def nearest_states(live: LiveRoom, taken: Taken) -> np.ndarray:
    places_m = np.column_stack([taken.table.x_m, taken.table.z_m])
    return np.linalg.norm(live.scene.locations_m[None] - places_m[:, None], axis=2).argmin(axis=1)


@pytest.mark.parametrize(
    "settings", [STILL, MOVING, replace(MOVING, held_out=True)], ids=["still", "moved", "held out"]
)
def test_poses_are_free_and_keep_to_their_cells(live, settings, monkeypatch):
    layouts: list = []
    found = placing.layouts
    monkeypatch.setattr(placing, "layouts", lambda *given: layouts.extend(found(*given)) or list(layouts))
    taken = drawn(live, settings)
    assert (live.scene.held_out[nearest_states(live, taken)] == settings.held_out).all()
    bodies = [live.body(layout) for layout in layouts]
    table = taken.table
    for row, shot in enumerate(taken.shots):
        body = bodies[table.arrangement[row]]
        body.stand_at(np.array([table.x_m[row], table.z_m[row]]))
        assert not body.touches and body.gap_m(REACH_M) == pytest.approx(table.clearance_m[row], abs=1e-9)
        moved_m = layouts[table.arrangement[row]].bodies_m if len(layouts) > 1 else ()
        assert shot == first_person_shot(
            table.x_m[row],
            table.z_m[row],
            table.heading_deg[row],
            height_m=table.height_m[row],
            pitch_deg=table.pitch_deg[row],
            moved_m=moved_m,
        )


def test_poses_are_anywhere_and_look_anywhere(live):
    taken = drawn(live, STILL)
    offsets_m = (
        np.column_stack([taken.table.x_m, taken.table.z_m]) - live.scene.locations_m[nearest_states(live, taken)]
    )
    assert np.abs(offsets_m).max() <= 0.25 and (offsets_m.std(axis=0) > 0.08).all()
    assert len(np.unique(taken.table.heading_deg // 45)) == 8
    assert (taken.table.height_m == 1).all() and (taken.table.pitch_deg == 0).all()
    assert (drawn(replace(live, camera_m=0.7), STILL).table.height_m == 0.7).all()
    on_grid = drawn(live, replace(STILL, scene_headings=True))
    assert set(on_grid.table.heading_deg) == {0, 90, 180, 270}


@pytest.mark.slow
def test_a_pose_follows_from_the_seed_the_room_and_its_number(live):
    def columns(taken: Taken) -> np.ndarray:
        return taken.table.to_array()

    one = columns(drawn(live, MOVING))
    np.testing.assert_array_equal(columns(drawn(live, MOVING)), one)
    np.testing.assert_array_equal(columns(drawn(live, replace(MOVING, poses=4))), one[:8])
    assert (columns(drawn(live, replace(MOVING, seed=1)))[:, 3:6] != one[:, 3:6]).all()
    renamed = replace(live, scene=replace(live.scene, name="other"))
    assert (columns(draw_takes(renamed, live.scene.held_out, MOVING))[:, 3:6] != one[:, 3:6]).all()


@pytest.mark.parametrize(
    ("perturbation", "changed"),
    [
        ({"distance_noise": 0.05}, {"x_m", "z_m"}),
        ({"angle_noise": 5.0}, {"heading_deg"}),
        ({"camera_height_jitter": 0.05}, {"height_m"}),
        ({"camera_pitch_jitter": 3.0}, {"pitch_deg"}),
        ({"move_furniture": 0.3}, {"arrangement"}),
        ({"new_obstacle": True}, {"arrangement"}),
        ({"light": 0.3}, set()),
    ],
)
def test_a_perturbation_changes_its_own_between_takes(live, perturbation, changed):
    settings = ViewSettings(poses=6, takes=2, perturbations=Perturbations(**perturbation))
    table = drawn(live, settings).table
    placed = ("arrangement", "x_m", "z_m", "heading_deg", "height_m", "pitch_deg")
    differ = {name for name in placed if (getattr(table, name)[::2] != getattr(table, name)[1::2]).any()}
    assert differ == changed
    assert table.pose.tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5] and table.take.tolist() == [0, 1] * 6


@pytest.mark.slow
def test_takes_see_the_room_in_layouts_of_their_own_or_as_it_was_built(live):
    table = drawn(live, replace(MOVING, poses=60, takes=3)).table
    arrangements = table.arrangement.reshape(-1, 3)
    assert set(table.arrangement.tolist()) == {0, 1, 2, 3, 4}  # 0 where a piece stands on the pose
    assert 0.5 < np.mean(table.arrangement > 0) < 1
    for own in arrangements.tolist():
        moved = [number for number in own if number]
        assert len(set(moved)) == len(moved)


@pytest.mark.slow
def test_distances_are_the_body_s(live):
    """In the corner free of furniture, facing along z: walls at x = 0 and z = 0, 2.5."""
    table = drawn(live, replace(STILL, poses=400)).table
    row = int(np.flatnonzero((table.x_m > 1.3) & (table.z_m < 0.6))[0])
    body = live.body(live.as_built())
    draws = drawn(live, STILL).draws[0]
    felt = poses._felt(body, (table.x_m[row], table.z_m[row], 180.0), draws, live)
    zone, clearance_m, ahead_m, left_m, right_m = felt[:5]
    x_m, z_m = table.x_m[row], table.z_m[row]
    assert ahead_m == pytest.approx(z_m - RADIUS_M, abs=0.011)
    assert left_m == pytest.approx(2 - x_m - RADIUS_M, abs=0.011)
    assert 0 < right_m <= x_m - RADIUS_M + 1e-9
    assert clearance_m == pytest.approx(min(z_m, 2 - x_m) - RADIUS_M, abs=1e-6)
    assert zone == Zone.COLLISION and ahead_m < 0.5
    stands = dict(zip(PLACES_M, felt[6:], strict=True))
    assert stands[0.0, 0.0] and stands[0.0, 0.5] == (right_m > 0.5)
    assert not stands[0.5, 0.0] and not stands[3.0, 0.0] and not stands[0.0, -2.0]
    assert body.place_m.tolist() == [x_m, z_m]
    np.testing.assert_allclose(np.rint(table.free_m / 0.01) * 0.01, table.free_m, atol=1e-9)
    assert (table.clearance_m <= table.free_m.min(axis=1) + 0.011).all()
    step_ahead = np.minimum(table.free_m[:, 0], table.free_m[:, 3])
    assert (table.zone[step_ahead < 0.49] == Zone.COLLISION).all()
    assert (table.zone[step_ahead > 1.01] == Zone.FREE).all()
    assert table.stands[:, PLACES_M.index((0.0, 0.0))].all()
    a_metre_ahead = table.stands[:, PLACES_M.index((1.0, 0.0))]
    assert a_metre_ahead[table.free_m[:, 0] > 1.0].all() and not a_metre_ahead[table.free_m[:, 0] < 0.7].all()


@pytest.mark.slow
def test_parts_that_cannot_be_reached_have_no_poses(live):
    """A cell that no move leads to or from, as another component."""
    scene, alone = live.scene, live.scene.cells == live.scene.cells.max()
    graph = scene.graph.copy()
    moves = graph[:, [0, 3]]
    moves[alone | (moves >= 0).any(axis=1) & np.isin(moves, np.flatnonzero(alone)).any(axis=1)] = -1
    graph[:, [0, 3]] = moves
    parted = replace(live, scene=replace(scene, graph=graph))
    assert set(parted.scene.components[alone]) != {0}
    held = np.zeros(scene.state_count, bool)
    taken = draw_takes(parted, held, replace(STILL, poses=300))
    assert not alone[nearest_states(parted, taken)].any()
    assert alone[nearest_states(live, draw_takes(live, held, replace(STILL, poses=300)))].any()


def test_nothing_is_moved_where_nothing_can_be(live):
    """A MuJoCo model of others."""
    with pytest.raises(SceneError, match="nothing can be moved in a MuJoCo model, and move_furniture is asked for"):
        draw_takes(replace(live, room=None), live.scene.held_out, MOVING)


def test_a_room_without_such_cells_is_told(live):
    nothing = np.zeros(live.scene.state_count, bool)
    with pytest.raises(SceneError, match="walkable: has no held-out cell in its largest part"):
        draw_takes(live, nothing, replace(STILL, held_out=True))
    with pytest.raises(SceneError, match="no cell that is not held out"):
        draw_takes(live, ~nothing, STILL)
