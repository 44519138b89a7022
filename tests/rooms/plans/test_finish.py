import numpy as np
import pytest

from clearway.rooms import finishes
from clearway.rooms.plans import finish as finish_module
from clearway.rooms.plans.finish import RUG_M, finish_of
from clearway.rooms.plans.layout import Layout, lay_out
from clearway.rooms.room import Room
from clearway.rooms.shell import SIDES, Finish, wall_size_m
from clearway.rooms.surfaces import pixels
from clearway.scenes.floor_plans import Area, FloorPlan
from helpers.plan_maps import walled

AREAS = (Area("bathroom", (1, 1), (3, 3)), Area("bedroom", (5, 1), (7, 3)))


def finished(plan: FloorPlan, seed: int = 0) -> tuple[Room, Layout, Finish]:
    layout = lay_out(plan, np.random.default_rng(seed))
    room = Room(plan.name, layout.width_m, layout.depth_m, 2.6, (0.35, 0.35), seed)
    return room, layout, finish_of(room, layout)


@pytest.mark.parametrize("areas", [(), AREAS])
def test_every_wall_and_face_has_a_picture_that_covers_it(areas: tuple[Area, ...]) -> None:
    room, layout, finish = finished(walled(areas=areas))
    assert len(finish.faces) == len(layout.faces) > 0
    for face, picture in zip(layout.faces, finish.faces, strict=True):
        assert picture.shape[0] == pixels(room.height_m) and picture.shape[1] >= pixels(face.length_m)
    for side in SIDES:
        width_m, height_m = wall_size_m(room, side)
        assert finish.walls[side].shape[:2] == (pixels(height_m), pixels(width_m))


def test_areas_have_papers_of_their_own_that_meet_in_the_wall(monkeypatch) -> None:
    shades = {"bathroom": 0.25, "bedroom": 0.75}
    monkeypatch.setattr(finish_module, "_paper", lambda room, side, use: np.full((416, 592, 3), shades[use]))
    monkeypatch.setattr(finishes, "aged", lambda room, side, wall: wall)
    _, layout, finish = finished(walled(areas=AREAS))  # 3.7 x 1.7 m; the wall's faces are at x = 1.7 and 2.0
    by_place = {round(face.at.x_m, 6): picture.mean() for face, picture in zip(layout.faces, finish.faces, strict=True)}
    assert by_place[1.7] == 0.25 and by_place[2.0] == 0.75
    north, south = (finish.walls[side][0, :, 0] for side in ("north", "south"))
    assert north[: pixels(1.84)].tolist() == [0.25] * pixels(1.84)
    assert north[pixels(1.86) :].tolist() == [0.75] * (len(north) - pixels(1.86))
    assert np.array_equal(south, north[::-1])  # its picture runs the other way
    assert finish.walls["west"].mean() == 0.25 and finish.walls["east"].mean() == 0.75


def test_areas_have_floors_of_their_own_that_meet_in_the_wall(monkeypatch) -> None:
    monkeypatch.setattr(finish_module, "_floor", lambda room: np.full((272, 592, 3), 0.75))
    monkeypatch.setattr(finishes, "floor_of", lambda room, tiles: np.full((272, 592, 3), 0.25))
    _, _, finish = finished(walled(areas=(AREAS[0], Area("corridor", (5, 1), (7, 3)))))
    assert (finish.floor[:, : pixels(1.84)] == 0.25).all() and (finish.floor[:, pixels(1.86) :] == 0.75).all()


@pytest.mark.parametrize(
    ("lines", "share"),
    [
        (("W" * 10, *["W" + "." * 8 + "W"] * 5, "W" * 10), 1.0),  # 4.2 x 2.7 m
        (("W" * 5, *["W...W"] * 3, "WWDWW", "W...W", "W" * 5), 0.7),  # 1.7 m square
        (("W" * 9, *["W.W...W.W"] * 3, "W" * 9), 0.7),  # the room in the middle, 1.7 m wide
        (("W" * 7, "W.....W", "WWWWDWW", "W.....W", "W" * 7), None),  # 0.7 m deep
    ],
)
def test_a_rug_lies_in_its_room_or_nowhere(lines: tuple[str, ...], share: float | None, monkeypatch) -> None:
    laid = []

    def with_rug(room: Room, floor: np.ndarray, middle_m: tuple[float, float], size_m: tuple[float, float]):
        laid.append((middle_m, size_m))
        return floor

    monkeypatch.setattr(finishes, "with_rug", with_rug)
    _, layout, _ = finished(walled("rug", lines))
    assert [size_m for _, size_m in laid] == ([] if share is None else [(share * RUG_M[0], share * RUG_M[1])])
    for middle_m, size_m in laid:
        low, high = np.array(middle_m) - np.array(size_m) / 2, np.array(middle_m) + np.array(size_m) / 2
        assert (low > 0).all() and (high < [layout.width_m, layout.depth_m]).all()
        for wall in layout.walls:
            apart_m = np.maximum(low - (wall.x_max_m, wall.y_max_m), (wall.x_min_m, wall.y_min_m) - high)
            assert apart_m.max() >= 0
