from __future__ import annotations

import numpy as np
import pytest

from clearway.errors import SceneError
from clearway.rooms import ROOM_NAMES, build_room
from clearway.rooms.bathroom import build as build_bathroom
from clearway.rooms.detail import FULL
from clearway.rooms.groups import OBSTACLE_GROUP
from clearway.rooms.navigation import find_grid
from clearway.scenes.graph import distances
from helpers.imported import imported_by

CELLS = {"bathroom": 45, "bedroom": 102, "living_room": 117, "kitchen": 169}
MEAN_PATH = {"bathroom": (8, 10), "bedroom": (12, 16), "living_room": (12, 17), "kitchen": (13, 17)}


def obstacles_of(room) -> np.ndarray:
    return np.array([[*geom.pos, *geom.quat, *geom.size] for geom in room.spec.geoms if geom.group == OBSTACLE_GROUP])


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 11, 1234])
@pytest.mark.parametrize("name", ROOM_NAMES)
def test_every_seed_gives_the_promised_grid(name, seed):
    grid = find_grid(build_room(name, seed, looks=False))
    assert len(grid.cells) == CELLS[name]
    assert grid.component_sizes == (CELLS[name],)
    assert 2.8 <= 2 * len(grid.edges) / len(grid.cells) <= 3.3
    low, high = MEAN_PATH[name]
    steps = distances(grid.graph)
    assert low <= steps[steps != 0].mean() <= high
    assert grid.smallest_margin_m > 0.02  # no cell and no move is decided by rounding


def test_an_odd_seed_mirrors_the_room():
    plain, mirrored = build_room("kitchen", 0, looks=False), build_room("kitchen", 1, looks=False)
    columns, rows = find_grid(plain).cells.max(axis=0)
    flipped = {(columns - x, y) for x, y in find_grid(plain).cells}
    assert {(x, y) for x, y in find_grid(mirrored).cells} == flipped
    assert rows == 15


def test_unknown_names_and_seeds_are_refused_in_one_line():
    with pytest.raises(SceneError, match=r"garage.*Choose one of bathroom, bedroom, living_room, kitchen") as caught:
        build_room("garage")
    assert "\n" not in str(caught.value)
    with pytest.raises(SceneError, match="seed must be 0 or more, found -1"):
        build_room("bathroom", -1)


def test_the_package_loads_without_mujoco():
    assert "mujoco" not in imported_by("import clearway.rooms")


@pytest.mark.slow
def test_the_obstacles_do_not_depend_on_the_looks():
    assert np.array_equal(obstacles_of(build_bathroom(3, True, FULL)), obstacles_of(build_bathroom(3, False, FULL)))


@pytest.mark.slow
def test_a_seed_repeats_and_another_differs():
    first, again, other = build_bathroom(2, True, FULL), build_bathroom(2, True, FULL), build_bathroom(4, True, FULL)
    for one, two in zip(first.surfaces, again.surfaces, strict=True):
        assert np.array_equal(one.albedo, two.albedo)
    for one, two in zip(first.parts, again.parts, strict=True):
        assert one.material == two.material
        assert np.array_equal(one.position_m, two.position_m)
        assert np.array_equal(one.uvs, two.uvs)
    assert not np.array_equal(first.surfaces[0].albedo, other.surfaces[0].albedo)
    assert first.colours != other.colours


def parts_outside(room) -> list[str]:
    """Visible parts that reach out of the room, by material (sills and the like may reach 2 cm into the wall)."""
    size = np.array([room.width_m, room.depth_m, room.height_m])
    reach = [np.abs(part.rotation) @ part.half_extents_m for part in room.parts]
    return [
        part.material
        for part, half in zip(room.parts, reach, strict=True)
        if (part.centre_m - half <= -0.02).any() or (part.centre_m + half >= size + 0.02).any()
    ]


def cheap(room) -> bool:
    """The room can be rendered fast, and nothing in it has a colour that is none."""
    model = room.spec.compile()
    shown = model.geom_dataid[model.geom_dataid >= 0]
    faces = model.mesh_facenum[shown].sum()
    return bool(model.ngeom <= 450 and faces <= 70_000 and model.geom_rgba.min() >= 0)


@pytest.mark.slow
def test_the_bathroom_is_ready_to_render():
    room = build_room("bathroom")
    assert parts_outside(room) == []
    assert cheap(room)


@pytest.mark.slow
@pytest.mark.parametrize("name", ROOM_NAMES)
def test_every_room_is_ready_to_render(name):
    room = build_room(name, 5)
    assert parts_outside(room) == []
    assert cheap(room)
