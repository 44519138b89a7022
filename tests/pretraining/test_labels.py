from __future__ import annotations

import numpy as np
import pytest

from clearway.perception.around import PLACES_M
from clearway.perception.token_grid import TokenGrid
from clearway.pretraining.labels import pair_labels, token_depth_m
from clearway.views.table import ViewTable

GRID = TokenGrid()
HEIGHT_PX, WIDTH_PX = 96, 128
WALL_M = 4.0  # of the wall that all look at, along z


def table_of_poses(*poses: tuple[float, float, float, float, float]) -> ViewTable:
    """Of x, z, heading, height and pitch."""
    x_m, z_m, heading_deg, height_m, pitch_deg = np.array(poses, float).T
    count = len(poses)
    whole = np.zeros(count, np.int32)
    return ViewTable(
        pose=whole,
        take=whole,
        arrangement=whole,
        x_m=x_m,
        z_m=z_m,
        heading_deg=heading_deg,
        height_m=height_m,
        pitch_deg=pitch_deg,
        zone=np.zeros(count, np.int8),
        clearance_m=np.zeros(count),
        free_m=np.zeros((count, 4)),
        stands=np.zeros((count, len(PLACES_M)), bool),
    )


def axes(heading_deg: float, pitch_deg: float) -> np.ndarray:
    """The camera's directions ahead, right and up as rows, each x, up, z."""
    heading, pitch = np.radians([heading_deg, pitch_deg])
    ahead = np.array([np.sin(heading) * np.cos(pitch), np.sin(pitch), np.cos(heading) * np.cos(pitch)])
    right = np.array([np.cos(heading), 0, -np.sin(heading)])
    return np.stack([ahead, right, np.cross(ahead, right) * [1, 1, 1]])


def wall_seen(table: ViewTable) -> np.ndarray:
    """Depth pictures (B, height, width) of the wall, uint16 millimetres."""
    edge = np.tan(np.radians(30))
    up = (1 - (np.arange(HEIGHT_PX) + 0.5) / HEIGHT_PX * 2)[:, None] * edge
    right = ((np.arange(WIDTH_PX) + 0.5) / WIDTH_PX * 2 - 1) * edge * 4 / 3
    depth = []
    for number in range(len(table)):
        ahead, across, above = axes(table.heading_deg[number], table.pitch_deg[number])
        towards = ahead[2] + right * across[2] + up * above[2]
        depth.append(np.where(towards > 0.05, (WALL_M - table.z_m[number]) / np.maximum(towards, 0.05), 30.0))
    return np.clip(np.array(depth) * 1000, 0, 65_535).astype(np.uint16)


def labels(*poses: tuple[float, float, float, float, float]):
    table = table_of_poses(*poses)
    return pair_labels(table, wall_seen(table), np.array([0]), np.array([1]), GRID)


def test_the_axes_of_a_camera_are_ahead_right_and_up():
    np.testing.assert_allclose(axes(0, 0), [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=1e-12)
    np.testing.assert_allclose(axes(90, 0), [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-12)


def test_a_camera_a_metre_ahead_and_a_metre_to_the_right():
    found = labels((0, 0, 0, 1, 0), (1, 1, 0, 1, 0))
    np.testing.assert_allclose(found.place_m, [[1, 1]], atol=1e-6)
    np.testing.assert_allclose(found.turn, [[1, 0]], atol=1e-6)
    # the token in row 2 and column 4 looks 0.096 up and to the right, at (0.385, 0.385) on the wall; from the other
    # camera that is 0.205 to the left and 0.128 up, in row 2.33 and column 2.93
    assert found.match[0, 2 * 8 + 4] == 2 * 8 + 2
    assert found.match[0, 0] == GRID.count  # the upper left one's is out of the other picture


def test_a_camera_turned_to_the_right_by_half_a_right_angle():
    found = labels((0, 0, 0, 1, 0), (0, 0, 45, 1, 0))
    np.testing.assert_allclose(found.turn, [[np.sqrt(0.5), np.sqrt(0.5)]], atol=1e-6)
    assert found.match[0, 3 * 8 + 7] == 3 * 8 + 2  # 34.0 degrees to the right of one, 11.0 to the left of the other
    assert np.all(found.match[0, 3 * 8 : 3 * 8 + 4] == GRID.count)
    assert found.overlap[0] == pytest.approx(np.mean(found.match < GRID.count))


def test_the_place_is_told_from_where_the_first_camera_looks():
    found = labels((2, 1, 90, 1, 0), (5, 2, 180, 1, 0))
    np.testing.assert_allclose(found.place_m, [[3, -1]], atol=1e-6)
    np.testing.assert_allclose(found.turn, [[0, 1]], atol=1e-6)
    assert found.overlap[0] == 0


def test_what_something_hides_has_no_match():
    table = table_of_poses((0, 0, 0, 1, 0), (0, 0.5, 0, 1, 0))
    depth = wall_seen(table)
    assert pair_labels(table, depth, np.array([0]), np.array([1]), GRID).overlap[0] > 0.7
    depth[1] = 900  # something stands before the second camera
    assert pair_labels(table, depth, np.array([0]), np.array([1]), GRID).overlap[0] == 0


def test_matches_agree_with_rotation_matrices():
    rng = np.random.default_rng(4)
    low, high = (-1, 0, -35, 0.8, -12), (1, 2, 35, 1.2, 12)
    matched = 0
    for _ in range(40):
        table = table_of_poses(*rng.uniform(low, high, (2, 5)))
        found = pair_labels(table, wall_seen(table), np.array([0]), np.array([1]), GRID).match[0]
        eyes_m = np.stack([table.x_m, table.height_m, table.z_m], axis=1)
        first, second = (axes(table.heading_deg[i], table.pitch_deg[i]) for i in (0, 1))
        for token, (up, right) in enumerate(GRID.slopes):
            ray = first[0] + right * first[1] + up * first[2]
            place = eyes_m[0] + ray * (WALL_M - eyes_m[0, 2]) / ray[2]
            deep, across, above = second @ (place - eyes_m[1])
            row, column = GRID.place(above / deep, across / deep)
            inside = 0 <= row < 6 and 0 <= column < 8
            near_edge = min(abs(row - round(row)), abs(column - round(column))) < 0.02
            if not near_edge:
                assert found[token] == (int(row) * 8 + int(column) if inside else GRID.count)
                matched += inside
    assert matched > 500


def test_token_depth_is_that_of_the_middle_of_each_field():
    depth = np.arange(HEIGHT_PX * WIDTH_PX, dtype=np.uint16).reshape(1, HEIGHT_PX, WIDTH_PX)
    tokens = token_depth_m(depth, GRID)
    assert tokens.shape == (1, 48) and tokens.dtype == np.float32
    np.testing.assert_allclose(
        tokens[0, [0, 1, 8]], [(8 * 128 + 8) / 1000, (8 * 128 + 24) / 1000, (24 * 128 + 8) / 1000]
    )
