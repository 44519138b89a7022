"""Maps: where zones and walks lie, and that the picture is drawn with and without a view from above."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from clearway import colours
from clearway.viz.figures import LINES
from clearway.viz.maps import VEIL, Walk, _triangles, draw_map
from clearway.zones import scene_zones
from helpers.made import corridor_scene, grid_scene

PATH = np.array([0, 4, 8, 9, 9, 10])  # forward twice, right, blocked, right


def test_a_walk_knows_its_blocked_moves():
    assert Walk("x", PATH).bumps.tolist() == [False, False, False, True, False]


def test_the_triangle_of_a_pose_lies_where_it_looks():
    scene = corridor_scene(3)
    middle = _triangles(scene).mean(axis=1) - scene.locations_m
    towards = np.array([[0, 1], [1, 0], [0, -1], [-1, 0]])[scene.headings_deg // 90]
    along, across = (middle * towards).sum(1), np.abs(middle * towards[:, ::-1]).sum(1)
    assert (along > 0.1).all() and np.allclose(across, 0)


def rgb(colour: str) -> list[int]:
    return list(bytes.fromhex(colour[1:]))


def colour_at(picture: Path, figure: Figure) -> Callable[[np.ndarray], list[int]]:
    """The map's red, green, blue at a place in metres."""
    pixels = np.asarray(Image.open(picture).convert("RGB"))

    def colour(place_m: np.ndarray) -> list[int]:
        column, row = figure.axes[0].transData.transform(place_m)
        return pixels[len(pixels) - 1 - round(row), round(column)].tolist()

    return colour


@pytest.mark.parametrize("from_above", [True, False])
def test_the_room_is_the_view_from_above_or_else_walls_and_free_cells(tmp_path, drawn, from_above):
    scene = grid_scene(1)
    assert scene.top_view is not None
    wall, floor = 60, 220  # of the view from above
    if not from_above:
        scene = replace(scene, top_view=None)
    draw_map(scene, tmp_path / "map.png", zones=np.zeros(scene.state_count, int))
    colour = colour_at(tmp_path / "map.png", drawn[0])
    inside = np.unique(scene.locations_m, axis=0)
    low, high = inside.min(axis=0), inside.max(axis=0)
    grid = np.stack(
        np.meshgrid(*(np.arange(a, b + 0.1, scene.cell_size_m) for a, b in zip(low, high, strict=True))), -1
    )
    obstacles = [place for place in grid.reshape(-1, 2) if not np.isclose(place, inside).all(axis=1).any()]
    assert obstacles
    veiled = VEIL * 255 + (1 - VEIL) * floor
    expected_wall = [wall] * 3 if from_above else rgb(colours.WALL)
    expected_floor = [veiled] * 3 if from_above else rgb(colours.ZONE_COLOURS["free"])
    assert all(colour(place) == expected_wall for place in obstacles)
    assert all(np.allclose(colour(place), expected_floor, atol=1) for place in inside)


@pytest.mark.slow
def test_title_and_legend_say_what_is_drawn(tmp_path, drawn):
    scene, path = corridor_scene(5), tmp_path / "deep" / "map.png"
    walks = [Walk("first", PATH), Walk("second", PATH[:3])]
    draw_map(scene, path, zones=scene_zones(scene), target=10, walks=walks, title="A corridor")
    assert drawn[0].axes[0].get_title(loc="left") == "A corridor"
    legend = [text.get_text() for text in drawn[0].legends[0].get_texts()]
    assert {"first: 5 steps, 1 collision", "second: 2 steps, 0 collisions"} < set(legend)
    assert legend[-3:] == [
        "start; the dart shows the heading",
        "target position and heading",
        "blocked move (a collision)",
    ]
    assert [file.name for file in path.parent.iterdir()] == ["map.png"]


def test_star_and_line_stand_at_their_poses(tmp_path, drawn):
    scene = grid_scene(1)
    states = [0]
    while len(states) < 30:  # along the walls: forward, or else to the right
        ahead, aside = (int(scene.graph[states[-1], action]) for action in (0, 1))
        states.append(ahead if ahead >= 0 else aside)
    target = int(np.flatnonzero(~np.isin(scene.cells, scene.cells[states]))[0])
    draw_map(
        scene,
        tmp_path / "map.png",
        zones=np.zeros(scene.state_count, int),
        target=target,
        walks=[Walk("", np.array(states))],
    )
    at = colour_at(tmp_path / "map.png", drawn[0])
    assert at(scene.locations_m[target]) == rgb(colours.TARGET)
    places_m = scene.locations_m[states]
    moved = (places_m[1:] != places_m[:-1]).any(axis=1)
    on_line = (0.7 * places_m[:-1] + 0.3 * places_m[1:])[moved]
    middle_m = (scene.locations_m.min(axis=0) + scene.locations_m.max(axis=0)) / 2
    assert len(np.unique(on_line, axis=0)) >= 4 and (np.abs(on_line - middle_m) > 0.1).any(axis=0).all()
    assert [at(place_m) for place_m in on_line] == [rgb(LINES[0].colour)] * len(on_line)


@pytest.mark.slow
def test_zones_change_the_map_and_nothing_else_is_needed(tmp_path):
    scene = grid_scene(1)
    zones = scene_zones(scene)
    draw_map(scene, tmp_path / "zones.png", zones=zones)
    draw_map(scene, tmp_path / "again.png", zones=zones)
    draw_map(scene, tmp_path / "free.png", zones=np.zeros_like(zones))
    pictures = [np.asarray(Image.open(tmp_path / f"{name}.png")) for name in ("zones", "again", "free")]
    assert np.array_equal(pictures[0], pictures[1])
    assert not np.array_equal(pictures[0], pictures[2])
